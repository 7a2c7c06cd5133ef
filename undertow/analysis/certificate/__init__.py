"""The stability certificate of a run: its Lyapunov function, and for how long the proof's hypotheses held."""

from undertow.analysis.certificate.certify import Certified as Certified
from undertow.analysis.certificate.certify import certify as certify
from undertow.analysis.certificate.set_point import lyapunov_function as lyapunov_function
from undertow.analysis.certificate.set_point import minimax_weight as minimax_weight
from undertow.analysis.certificate.set_point import share_increasing as share_increasing
