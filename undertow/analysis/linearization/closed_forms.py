"""Closed forms of the theory for a controller, to compare with the linearisation of the whole loop."""

from typing import NamedTuple

import numpy as np

from undertow.analysis.theory import theory_of
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
        law: a controller; there is nothing for one without closed forms.
        poles: of the whole loop, 1/s.
        names: of the axes.
    """
    axes_of_pole: dict[tuple[str, complex], list[str]] = {}
    for axis, name in enumerate(names):
        for meaning, pole in theory_of(law).poles(axis):
            key = (meaning, complex(round(pole.real, 9), round(abs(pole.imag), 9)))
            axes = axes_of_pole.setdefault(key, [])
            if name not in axes:
                axes.append(name)
    rows = []
    for (meaning, pole), axes in axes_of_pole.items():
        distance = np.abs(poles - pole)
        where = "" if len(axes) == len(names) else f" ({', '.join(axes)})"
        rows.append(ClosedForm(meaning + where, pole, complex(poles[distance.argmin()])))
    return rows
