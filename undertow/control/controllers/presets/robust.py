"""Preset `robust`: the robust variant, with gains from a few physical numbers."""

import numpy as np

from undertow.control.controllers.bandwidths import axes_of, default_bandwidths
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.control.controllers.reference_filter import ReferenceFilter
from undertow.control.controllers.robust.estimator import Estimator, widened
from undertow.control.controllers.robust.robust_law import RobustRCAF
from undertow.control.estimation.fuzzy_system import gaussian_sets
from undertow.core import checks
from undertow.core.arrays import as_array, library_of
from undertow.core.contracts import Model
from undertow.core.errors import BadInput
from undertow.core.option_groups import flat_options


@flat_options("feedforward", "motor")
def robust(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    bandwidth=None,
    damping=1.0,
    tracking_share=0.0,
    tracking=None,
    feedback=None,
    weight=((10.0, 0.0), (0.0, 10.0)),
    pole=None,
    adaptation=None,
    composite=None,
    robust_gain=0.0,
    layer=0.5,
    weights_bound=50.0,
    leakage=0.01,
    actuation: ActuationOptions = ActuationOptions(),
    sets: int = 5,
    reach=None,
    width: float | None = None,
) -> RobustRCAF:
    """The robust law: body axes and quaternions for a vehicle, projected weights, limits respected.

    Args:
        model: nominal model, from `plant.model()`.
        sampling_time: that of the loop, s; a scenario sets it. From Python, give the `dt` of `simulate`: gains for a
            shorter one track more closely, but with less margin and more chattering than the rule allows.
        bandwidth: natural frequency of the estimator, rad/s; None: the one of least predicted cost among those that
            keep the margins of `controllers/bandwidths.py` against unknown lag and delay.
        damping: damping ratio of the estimator.
        tracking_share: mu, share of the filtered tracking error in the adaptation; 0 for a pure observer.
        tracking: natural frequency of the tracking error, critically damped, rad/s; None: chosen with the bandwidth;
            with a given bandwidth between a quarter and half of it.
        feedback: K = (k1, k2) instead of `tracking`, 1/s^2 and 1/s; one pair or one per axis.
        weight: Q of Eq. (21).
        pole: alpha_F, with `adaptation` and `composite` instead of `bandwidth`, `damping` and `tracking_share`, 1/s.
        adaptation: gamma, likewise.
        composite: gamma_eps, likewise.
        robust_gain: w_bar, m/s^2 and rad/s^2.
        layer: boundary layer of the robust term.
        weights_bound: theta_max, m/s^2 and rad/s^2: the largest uncertainty that can be estimated.
        leakage: decay rate of differences between the weights of an axis, which noise causes, 1/s; 0 for none.
        actuator_rate: bandwidth of the motor loop, 1/s; None: chosen with the bandwidth; with a given bandwidth three
            times that, if sampling allows.
        sets: fuzzy sets; any number from 1.
        reach: outermost centres, m/s and rad/s; None: so large that weights within their box add at most a tenth
            to the damping of the estimator.
        width: width of the sets as a share of `reach`; None: their spacing.

    Raises:
        BadInput: a value is out of its range, or two options set the same quantity.
    """
    fuzzy = gaussian_sets(sets, tuple(np.ravel(1.0 if reach is None else reach)), width)
    letters = {"pole": pole, "adaptation": adaptation, "composite": composite}
    if any(value is not None for value in letters.values()):
        bandwidth, damping, tracking_share = _from_letters(letters, float(fuzzy.basis_norm_squared()), bandwidth)
    model = model.in_body_axes()
    if feedback is not None and tracking is not None:
        raise BadInput("tracking", "be left out when there is `feedback`", tracking)
    actuator_rate, reference_frequency = actuation.actuator_rate, actuation.reference_frequency
    if any(rate is None for rate in (bandwidth, tracking, actuator_rate)):
        axes = axes_of(model, conditions)
        bandwidth, tracking, actuator_rate = default_bandwidths(axes, bandwidth, tracking, actuator_rate)
    for name, value, unit in (("bandwidth", bandwidth, "rad/s"), ("tracking", tracking, "rad/s")):
        checks.positive(name, value, unit)
    if reach is None:
        fuzzy = widened(fuzzy, bandwidth, damping, weights_bound)
    library = library_of(tracking)
    tracking = library.asarray(tracking, dtype=float)
    if feedback is None:
        feedback = as_array(library.stack([tracking**2, 2 * tracking], -1))
    if reference_frequency is None:
        reference_frequency = as_array(library.minimum(tracking / 2, 2.0))
    jumps = checks.assumed(lambda frequency: (frequency != 0).any(), reference_frequency)
    return RobustRCAF(
        model=model,
        estimator=Estimator(fuzzy, bandwidth, damping, weights_bound, leakage),
        filter=ReferenceFilter(reference_frequency) if jumps else None,
        feedback=feedback,
        weight=weight,
        tracking_share=tracking_share,
        robust_gain=robust_gain,
        layer=layer,
        actuator_rate=actuator_rate,
        direction=actuation.direction,
    )


def _from_letters(letters: dict, basis_norm_squared: float, bandwidth):
    """(bandwidth, damping, tracking share) from the gains of Table 1: section 3.12 of the theory."""
    for name, value in letters.items():
        if value is None:
            raise BadInput(name, "be given with the other two of pole, adaptation and composite")
    if bandwidth is not None:
        raise BadInput("bandwidth", "be left out when there are pole, adaptation and composite", bandwidth)
    pole, adaptation, composite = (np.asarray(value, dtype=float) for value in letters.values())
    if not (composite > 0).all():
        raise BadInput("composite", "be positive", composite, hint="The robust law has no case gamma_eps = 0 (RAFC)")
    natural = np.sqrt(adaptation * composite * basis_norm_squared)
    return natural, pole / (2 * natural), 1 / composite
