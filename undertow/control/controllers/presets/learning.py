"""Preset `learning`: the robust variant with a memory of the uncertainty along the reference."""

import dataclasses
from typing import Annotated

import jax.numpy as jnp
import numpy as np

from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.control.controllers.presets.robust import robust
from undertow.control.controllers.robust.inertia import InertiaIdentification
from undertow.control.controllers.robust.knowledge import Knowledge, load_knowledge
from undertow.control.controllers.robust.memory import memory
from undertow.control.controllers.robust.robust_law import RobustRCAF
from undertow.core import catalogue, checks
from undertow.core.contracts import Model
from undertow.core.option_groups import flat_options

_PROBING = 0.2  # rad/s^2
_SPREAD = 0.8, 1.2  # of the frequencies of the axes


@flat_options("feedforward", "motor")
def learning(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    bandwidth=None,
    damping=1.0,
    tracking=None,
    feedback=None,
    weights_bound=50.0,
    actuation: ActuationOptions = ActuationOptions(),
    regressor: str = "both",
    rules: int = 5,
    speeds=0.5,
    horizon=300.0,
    learning_rate=10.0,
    memory_bound=20.0,
    judging_time=30.0,
    probing=None,
    knowledge: Annotated[str | None, catalogue.FILE] = None,
) -> RobustRCAF:
    """The robust law with a memory: d_hat = memory(reference) + observer(rest), at the gains of preset `robust`.

    Args:
        model: nominal model, from `plant.model()`.
        bandwidth: natural frequency of the observer, rad/s; None: chosen as in preset `robust`.
        damping: damping ratio of the observer.
        tracking: natural frequency of the tracking error, critically damped, rad/s; None: as in preset `robust`.
        feedback: K = (k1, k2) instead of `tracking`, 1/s^2 and 1/s; one pair or one per axis.
        weights_bound: theta_max, m/s^2 and rad/s^2: the largest uncertainty that the observer can estimate.
        reference_frequency: that of the filter of reference jumps, rad/s; None: as in preset `robust`; 0 for none.
        actuator_rate: bandwidth of the motor loop, 1/s; None: as in preset `robust`.
        regressor: `rules`, fuzzy rules of each velocity, `linear`, v and v |v|, or `both`.
        rules: fuzzy sets of each velocity, an odd number from 3.
        speeds: velocity at the outermost sets, m/s and rad/s; one number or one per axis.
        horizon: time over which motions that are repeated are forgotten, s.
        learning_rate: p_0, 1/s: how fast it learns at first.
        memory_bound: largest weight of the memory, m/s^2 and rad/s^2.
        judging_time: time over which the memory is judged; one that harms is used less, and a vehicle that has changed
            is learnt anew, s.
        probing: acceleration of the oscillation that identifies the inertia in the first minutes, m/s^2 and rad/s^2;
            one number or one per axis, 0 for none; None: 0.2 rad/s^2 for angles, which is 0.3 degrees at 100 Hz. Where
            errors are small it is smaller, 0.3 of their rms.
        knowledge: path of a file of `save_knowledge`: what was learnt before.

    Raises:
        BadInput: a value is out of its range, or the knowledge does not fit.
    """
    law = robust(
        model,
        conditions=conditions,
        bandwidth=bandwidth,
        damping=damping,
        tracking=tracking,
        feedback=feedback,
        weights_bound=weights_bound,
        actuation=actuation,
    )
    axes = len(law.model.coordinates.angles)
    learnt = None if knowledge is None else load_knowledge(knowledge)
    remembered = memory(
        axes,
        regressor=regressor,
        rules=rules,
        speeds=speeds,
        horizon=horizon,
        learning_rate=learning_rate,
        bound=memory_bound,
        judging_time=judging_time,
        inertia=_identification(law, axes, probing, learnt),
        knowledge=learnt,
    )
    return dataclasses.replace(law, memory=remembered)


def _identification(law: RobustRCAF, axes: int, probing, learnt: Knowledge | None) -> InertiaIdentification | None:
    """Between the bandwidths of tracking and observer, another frequency for each axis."""
    if probing is not None:
        checks.per_axis("probing", probing, axes)
    angles = np.asarray(law.model.coordinates.angles)
    amplitude = np.where(angles, _PROBING, 0.0) if probing is None else np.broadcast_to(probing, (axes,))
    expected = None if learnt is None else learnt.inertia
    if expected is None and not checks.traced(amplitude) and not np.any(amplitude):
        return None
    middle = jnp.sqrt(jnp.sqrt(law.feedback[..., 0]) * law.estimator.bandwidth)
    return InertiaIdentification(amplitude=amplitude, frequency=middle * np.linspace(*_SPREAD, axes), expected=expected)
