"""Equations of an equilibrium of a closed loop, and Newton's method for them."""

from typing import NamedTuple

import numpy as np

from undertow.analysis.linearization.jacobians import Local, Parts

_STEPS = 30
_LENGTHS = (1.0, 0.5, 0.25, 0.1)  # of a step
_WORSE = 1e3  # times the residual before: further than this nothing is looked for
_AT_REST = 1e-8  # of what moves, in SI units

Names = tuple[str, ...]


class Balance(NamedTuple):
    """The equations of rest.

    Attributes:
        parts: the loop.
        dt: sampling time, s.
        acting: which entries of the plant's state act on anything.
        steered: projection of errors on those that an input can move; others are left to the plant.
    """

    parts: Parts
    dt: float
    acting: np.ndarray
    steered: np.ndarray

    def residual(self, local: Local, at: dict, unknown: Names, still: Names) -> tuple[np.ndarray, np.ndarray]:
        """What must vanish (plant, outputs, law, command), and its slopes with respect to the unknown."""
        values, slopes = local.values, local.slopes
        own = lambda name, by: np.eye(len(at[name])) if name == by else 0
        equations = {
            "plant": lambda: (values["plant"][self.acting], [slopes["plant"][by][self.acting] for by in unknown]),
            "outputs": lambda: (self.steered @ values["error"], [self.steered @ slopes["error"][by] for by in unknown]),
            "law": lambda: (
                (values["law"] - at["law"]) / self.dt,
                [(slopes["law"][by] - own("law", by)) / self.dt for by in unknown],
            ),
            "command": lambda: (values["u"] - at["u"], [slopes["u"][by] - own("u", by) for by in unknown]),
        }
        residuals, rows = zip(*(equations[name]() for name in still), strict=True)
        return np.concatenate(residuals), np.block(list(rows))

    def solve(self, at: dict, unknown: Names, still: Names) -> dict:
        """Vectors from `at` on at which it vanishes: smallest steps, shortened while they make it worse."""

        def look(at: dict):
            residual, jacobian = self.residual(self.parts.differentiate(at, self.dt), at, unknown, still)
            finite = np.isfinite(residual).all() and np.isfinite(jacobian).all()
            return residual, jacobian, float(np.abs(residual).max(initial=0.0)) if finite else np.inf

        residual, jacobian, size = look(at)
        ends = np.cumsum([len(at[name]) for name in unknown])[:-1]
        for _ in range(_STEPS):
            if not _AT_REST < size < np.inf:
                break
            scale = np.abs(jacobian).max(axis=1, keepdims=True)
            scale[scale == 0] = 1.0
            step = np.split(-np.linalg.lstsq(jacobian / scale, residual / scale[:, 0], rcond=1e-11)[0], ends)
            found, trial = (residual, jacobian, np.inf), at
            for length in _LENGTHS:
                there = at | {name: at[name] + length * part for name, part in zip(unknown, step, strict=True)}
                looked = look(there)
                if looked[2] < found[2]:
                    found, trial = looked, there
                if found[2] < size:
                    break
            if not found[2] < _WORSE * size:  # far from rest a larger residual may still be the way
                break
            at, (residual, jacobian, size) = trial, found
        return at
