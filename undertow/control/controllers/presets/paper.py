"""Preset `paper`: Table 1, its fuzzy sets, and options."""

import math

from undertow.control.controllers.composite_law import FUZZY_INPUTS, RCAF
from undertow.control.controllers.robust_modification import modification_of
from undertow.control.estimation.fuzzy_system import gaussian_sets
from undertow.control.estimation.series_parallel import SeriesParallel
from undertow.core import checks
from undertow.core.contracts import Model
from undertow.core.errors import BadInput

# Outermost sets of each fuzzy input. The paper does not give centres and widths: for eps, m/s and rad/s, as in the
# benchmark; for the state input, wide enough for the paper's step of 4 m and its velocities.
_REACH = {"error": (1.0,), "state": (4.0, 2.0)}


def paper(
    model: Model,
    *,
    feedback=(1.0, 2.0),
    weight=((10.0, 0.0), (0.0, 10.0)),
    adaptation=100.0,
    composite=500.0,
    robust_gain=10.0,
    layer=0.5,
    pole=150.0,
    compensation_gain=0.1,
    compensation_layer=0.5,
    weights_bound=math.inf,
    leakage=0.0,
    e_modification=0.0,
    dead_zone=0.0,
    identification_input: str = "applied",
    switching: str = "tanh",
    fuzzy_input: str = "error",
    sets: int = 5,
    reach=None,
    width: float | None = None,
    method: str = "euler",
    substeps: int = 1,
) -> RCAF:
    """The paper's law; every default is Table 1.

    Args:
        model: nominal model, from `plant.model()`.
        feedback: K = (k1, k2), 1/s^2 and 1/s; one pair or one per axis.
        weight: Q of Eq. (21).
        adaptation: gamma.
        composite: gamma_eps; 0 gives RAFC, Eq. (61).
        robust_gain: w_bar, m/s^2 and rad/s^2.
        layer: boundary layer of the robust term.
        pole: alpha_F of the identification model, 1/s.
        compensation_gain: omega_bar, m/s^2 and rad/s^2.
        compensation_layer: boundary layer of the compensation.
        weights_bound: theta_max, m/s^2 and rad/s^2; weights, and with them the estimate, are projected into
            +-theta_max. The paper has none.
        leakage: kappa of the sigma-modification: weights decay at gamma kappa, 1/s. The paper has none.
        e_modification: factor of |eps| beside `leakage`, s/m and s/rad. The paper has none.
        dead_zone: largest |eps| that is treated as noise and stops adaptation, m/s and rad/s. The paper has none.
        identification_input: input of the identification model: applied (that of the actuators) or commanded (before
            limits).
        switching: tanh (Remark 5) or sign (as in Eqs. (33), (43)).
        fuzzy_input: error (the modelling error) or state (position and velocity).
        sets: fuzzy sets per input; any number from 1.
        reach: outermost centres, one per fuzzy input; None: 1 for the error, 4 and 2 for the state.
        width: width of the sets as a share of `reach`; None: their spacing.
        method: discretisation of the law in the sampled loop, euler or rk4.
        substeps: steps of `method` per sampling time.

    Raises:
        BadInput: a value is out of its range.
    """
    checks.choice("fuzzy_input", fuzzy_input, FUZZY_INPUTS)
    checks.choice("method", method, ("euler", "rk4"))
    if substeps < 1:
        raise BadInput("substeps", "be 1 or more", substeps)
    reach = _REACH[fuzzy_input] if reach is None else reach
    checks.length("reach", reach, len(_REACH[fuzzy_input]), f"one per input of fuzzy_input = {fuzzy_input}")
    return RCAF(
        model=model,
        fuzzy=gaussian_sets(sets, tuple(reach), width),
        identification=SeriesParallel(pole, compensation_gain, compensation_layer, switching),
        feedback=feedback,
        weight=weight,
        adaptation=adaptation,
        composite=composite,
        robust_gain=robust_gain,
        layer=layer,
        weights_bound=weights_bound,
        modification=modification_of(leakage, e_modification, dead_zone),
        identification_input=identification_input,
        switching=switching,
        fuzzy_input=fuzzy_input,
        method=method,
        substeps=substeps,
    )
