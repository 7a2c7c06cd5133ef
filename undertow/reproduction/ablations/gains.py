"""The numbers that a linear law needs to do in small signal what Table 1 does. Section 3.1 of the theory."""

from undertow.analysis.small_signal import gains
from undertow.controllers.presets.paper import paper
from undertow.plants.double_integrator import double_integrator

_TABLE1 = gains(paper(double_integrator(1).model()))

POLE = _TABLE1.pole  # 1/s
STIFFNESS = _TABLE1.b2  # 1/s^2, of the estimator
FEEDBACK = (_TABLE1.stiffness, _TABLE1.damping)  # 1/s^2, 1/s: K and the slope of the robust term
BANDWIDTH = STIFFNESS**0.5  # rad/s
DAMPING = POLE / (2 * BANDWIDTH)
COMPOSITE = _TABLE1.composite
EQUAL_GAIN = 1 + COMPOSITE * FEEDBACK[0] / (POLE * _TABLE1.p12)  # loop gain of RCAFC over that of RAFC
