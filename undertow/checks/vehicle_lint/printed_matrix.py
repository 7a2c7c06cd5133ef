"""Comparison of a printed thruster matrix with the poses of the thrusters."""

from collections.abc import Iterator

import numpy as np

from undertow.checks.finding import Finding, error
from undertow.vehicles.facts import DOF_NAMES, Facts

_ROUNDING = 0.02  # of the largest entry of a row: printed matrices have two or three digits


def printed_matrix(facts: Facts) -> Iterator[Finding]:
    """Compare each row with the poses; one finding per wrong row."""
    if facts.printed_matrix is None:
        return
    expected = facts.thruster_matrix + 0.0  # no minus zeros
    for row, (printed, computed) in enumerate(zip(facts.printed_matrix, expected, strict=True)):
        largest = np.maximum(np.abs(printed), np.abs(computed)).max()
        off = np.flatnonzero(np.abs(printed - computed) > _ROUNDING * largest)
        if len(off):
            j = int(off[np.argmax(np.abs(printed - computed)[off])])
            must = f"agree with the poses, which give {computed[j]:.4g} for `thrusters[{j}]` in {DOF_NAMES[row]}"
            got = f"{printed[j]:.4g}{_others(off)}"
            yield error("printed_matrix", f"thruster_matrix[{row}]", must, got, _likely(printed[off], computed[off]))


def _others(off: np.ndarray) -> str:
    return f" ({len(off)} entries of this row are off)" if len(off) > 1 else ""


def _likely(printed: np.ndarray, computed: np.ndarray) -> str:
    """Likely mistake."""
    if np.allclose(printed, -computed, rtol=_ROUNDING):
        return "Opposite sign" if len(printed) == 1 else "They have the opposite sign: another frame, or a wrong one"
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs(printed / computed)
    if np.all(np.abs(ratio - np.sqrt(2)) < 0.05 * np.sqrt(2)):
        return "The arm was not multiplied by sin 45 degrees"
    if np.all(np.isfinite(ratio)) and np.ptp(ratio) < 0.02 * ratio.max():
        return f"The arms are {ratio[0]:.3g} times too long: another vehicle's, or another unit"
    return "Is it the matrix of another layout, order or frame?"


RULES = (printed_matrix,)
