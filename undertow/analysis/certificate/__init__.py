"""Lyapunov functions of the controllers from recorded signals, and the hypotheses of the stability proof."""

from undertow.analysis.certificate.set_point import lyapunov_function as lyapunov_function
from undertow.analysis.certificate.set_point import minimax_weight as minimax_weight
from undertow.analysis.certificate.set_point import share_increasing as share_increasing
