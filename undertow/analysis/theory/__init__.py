"""What is known of a controller without running it: closed forms, bounds, certificate. Ask `theory_of(controller)`."""

from undertow.analysis.theory import composite as composite
from undertow.analysis.theory import robust as robust
from undertow.analysis.theory.contract import RunCertificate as RunCertificate
from undertow.analysis.theory.contract import SteadyWindow as SteadyWindow
from undertow.analysis.theory.contract import Theory as Theory
from undertow.analysis.theory.contract import register as register
from undertow.analysis.theory.contract import theory_of as theory_of
