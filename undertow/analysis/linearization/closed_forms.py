"""Closed forms of the theory for a controller, to compare with the linearisation of the whole loop."""

from typing import NamedTuple, TypeGuard

import numpy as np

from undertow.analysis import drift, small_signal
from undertow.controllers.composite_law import RCAF
from undertow.controllers.robust.robust_law import RobustRCAF
from undertow.core.contracts import AbstractController


class ClosedForm(NamedTuple):
    """One pole of the small model, and the nearest of the whole loop."""

    meaning: str
    expected: complex  # 1/s
    nearest: complex  # 1/s

    @property
    def departure(self) -> float:
        """Distance as a share of the expected pole."""
        return abs(self.nearest - self.expected) / abs(self.expected)


def closed_form_poles(law: AbstractController, poles: np.ndarray, names: tuple[str, ...]) -> list[ClosedForm]:
    """Poles of the law on axes that obey at once, each with the nearest pole of the whole loop.

    Args:
        law: of either preset; there is nothing for others.
        poles: of the whole loop, 1/s.
        names: of the axes.
    """
    found: dict[tuple[str, complex], list[str]] = {}
    for axis, name in enumerate(names):
        for meaning, pole in _of_axis(law, axis):
            key = (meaning, complex(round(pole.real, 9), round(abs(pole.imag), 9)))
            axes = found.setdefault(key, [])
            if name not in axes:
                axes.append(name)
    rows = []
    for (meaning, pole), axes in found.items():
        distance = np.abs(poles - pole)
        where = "" if len(axes) == len(names) else f" ({', '.join(axes)})"
        rows.append(ClosedForm(meaning + where, pole, complex(poles[distance.argmin()])))
    return rows


def estimator(law: AbstractController, axis: int) -> tuple[float, float] | None:
    """Natural frequency (rad/s) and damping ratio of the estimator; None for a law without one."""
    if isinstance(law, RobustRCAF):
        at = lambda value: float(
            np.broadcast_to(np.asarray(value, dtype=float), len(law.model.coordinates.angles))[axis]
        )
        return at(law.estimator.bandwidth), at(law.estimator.damping)
    if _is_smooth(law) and small_signal.observer_frequency(law, axis) > 0:
        return small_signal.observer_frequency(law, axis), small_signal.observer_damping(law, axis)
    return None


def ramp_error(law: AbstractController, axis: int) -> float | None:
    """Steady |d_hat - d| per |d_dot|, s: 2 zeta / w_o of a pure observer, section 3.4 else."""
    if _is_smooth(law):
        return small_signal.ramp_error(law, axis)[1]
    known = estimator(law, axis)
    return 2 * known[1] / known[0] if known else None


def drift_bound(law: AbstractController, axis: int, dt: float) -> tuple[float, float] | None:
    """Largest gain c that weights in their box can add, and the one at which the estimator breaks, 1/s."""
    if isinstance(law, RCAF):
        known = _is_smooth(law) and law.fuzzy.inputs == 1 and (law.method, law.substeps) == ("euler", 1)
    else:
        known = isinstance(law, RobustRCAF)
    return (drift.gain_bound(law, axis), drift.largest_gain(law, dt, axis)) if known else None


def _of_axis(law: AbstractController, axis: int) -> list[tuple[str, complex]]:
    if isinstance(law, RobustRCAF):
        at = lambda value, *shape: np.broadcast_to(
            np.asarray(value, dtype=float), (len(law.model.coordinates.angles), *shape)
        )
        k, p = at(law.feedback, 2)[axis], at(law.lyapunov(), 2, 2)[axis]
        slope = at(law.robust_gain)[axis] / at(law.layer)[axis]
        tracking = np.roots([1.0, k[1] + slope * p[1, 1], k[0] + slope * p[0, 1]])
        frequency, damping = estimator(law, axis) or (0.0, 0.0)
        observer = np.roots([1.0, 2 * damping * frequency, frequency**2])
        return [("estimator", complex(pole)) for pole in observer] + [("tracking", complex(pole)) for pole in tracking]
    if _is_smooth(law):
        return [("Table 1's four states", complex(pole)) for pole in small_signal.poles(law, axis)]
    return []


def _is_smooth(law: AbstractController) -> TypeGuard[RCAF]:
    """Whether it is the paper's law, with slopes."""
    return isinstance(law, RCAF) and "sign" not in (law.switching, law.identification.switching)
