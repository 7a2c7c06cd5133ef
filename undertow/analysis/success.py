"""Whether control succeeded: the verdict of a stated criterion, beside whether the run reached its end."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from undertow.core.errors import BadInput, did_you_mean
from undertow.core.metric import Metric

# Of tracking, in the steady window, where a scenario has no criterion of its own: 5 cm, and 0.05 rad (2.9 degrees).
DEFAULT = {"position_rms": 0.05, "attitude_rms": 0.05}  # m, rad
# A law that drives its inputs from limit to limit may track well for a while, but is no success on a vehicle.
SATURATED = {"saturated_fraction": 0.25}


class Success(NamedTuple):
    """What was judged, and how; true where the run kept to its criterion, as in `if run.success`.

    Attributes:
        criterion: metric -> what its value in the steady window must stay below, in the unit of the metric.
        exceeded: those of them that do not, or that are not defined.
        within: whether all do.
    """

    criterion: dict[str, float]
    exceeded: dict[str, float | None]
    within: bool

    def __bool__(self) -> bool:
        """Whether the run kept to its criterion; a tuple that is not empty would always be true."""
        return self.within


def criterion_of(criterion: Mapping[str, float] | None, metrics: Mapping[str, Metric]) -> dict[str, float]:
    """What a run is judged by: what the scenario says, or the default for what its plant has; {} for nothing.

    Raises:
        BadInput: a metric that this plant does not have.
    """
    if criterion is None:
        tracking = {name: most for name, most in DEFAULT.items() if name in metrics}
        return tracking | SATURATED if tracking else {}
    for name in criterion:
        if name not in metrics:
            must = "be a metric of this plant"
            raise BadInput(name, must, "unknown", hint=did_you_mean(name, metrics))
    return dict(criterion)


def evaluate_success(criterion: Mapping[str, float], steady: Mapping[str, Any] | None) -> Success | None:
    """Verdict on a run from the metrics of its steady window; None where it ended early, or without a criterion."""
    if not criterion:
        return None
    if steady is None:
        return Success(dict(criterion), {}, False)
    exceeded = {name: steady.get(name) for name, most in criterion.items() if not steady.get(name, math.inf) < most}
    return Success(dict(criterion), exceeded, not exceeded)
