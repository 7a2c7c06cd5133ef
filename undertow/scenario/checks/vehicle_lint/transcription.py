"""Mistakes of transcription: a printed thruster matrix that its poses contradict, inertia of another vehicle."""

import functools
from collections.abc import Iterator

import numpy as np

from undertow.core import catalogue
from undertow.core.measurement import BODY_AXES
from undertow.physics.vehicles.facts import Facts, facts_of
from undertow.physics.vehicles.published import inertia_about_origin
from undertow.scenario.checks.finding import Finding, advice, error

_ROUNDING = 0.02  # of the largest entry of a row: printed matrices have two or three digits


def printed_matrix(facts: Facts) -> Iterator[Finding]:
    """Compare each row with the poses; one finding per wrong row."""
    if facts.printed_matrix is None:
        return
    expected = facts.thruster_matrix + 0.0  # no minus zeros
    for row, (printed, computed) in enumerate(zip(facts.printed_matrix, expected, strict=True)):
        largest = np.maximum(np.abs(printed), np.abs(computed)).max()
        wrong_entries = np.flatnonzero(np.abs(printed - computed) > _ROUNDING * largest)
        if len(wrong_entries):
            j = int(wrong_entries[np.argmax(np.abs(printed - computed)[wrong_entries])])
            must = f"agree with the poses, which give {computed[j]:.4g} for `thrusters[{j}]` in {BODY_AXES[row]}"
            got = f"{printed[j]:.4g}{_others(wrong_entries)}"
            mistake = _likely(printed[wrong_entries], computed[wrong_entries])
            hint = f"{mistake} If you moved a thruster, delete `thruster_matrix` or update it"
            yield error("printed_matrix", f"thruster_matrix[{row}]", must, got, hint)


def _others(wrong_entries: np.ndarray) -> str:
    return f" ({len(wrong_entries)} entries of this row are off)" if len(wrong_entries) > 1 else ""


def _likely(printed: np.ndarray, computed: np.ndarray) -> str:
    """Likely mistake."""
    if np.allclose(printed, -computed, rtol=_ROUNDING):
        return "Opposite sign." if len(printed) == 1 else "They have the opposite sign: another frame, or a wrong one."
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs(printed / computed)
    if np.all(np.abs(ratio - np.sqrt(2)) < 0.05 * np.sqrt(2)):
        return "The arm was not multiplied by sin 45 degrees."
    if np.all(np.isfinite(ratio)) and np.ptp(ratio) < 0.02 * ratio.max():
        size = max(ratio[0], 1 / ratio[0])
        excess = "long" if ratio[0] > 1 else "short"
        return f"The matrix's arms are {size:.3g} times too {excess} for the poses: another vehicle's, or another unit."
    return "Is it the matrix of another layout, order or frame?"


_DIGITS = 1e-3  # of the largest entry
_OTHER_MASS = 0.1  # relative; a vehicle of the same mass may have the same inertia


def copied(facts: Facts) -> Iterator[Finding]:
    """Compare with every vehicle of the catalogue, about the centre of gravity and about the origin."""
    for vehicle in _known():
        if abs(facts.mass / vehicle.mass - 1) < _OTHER_MASS:
            continue
        pairs = (facts.inertia, vehicle.inertia), (_about_origin(facts), _about_origin(vehicle))
        for power in (power for pair in pairs for power in _moved(*pair)):
            scale = "" if power == 0 else f"{10**power} times " if power > 0 else f"1/{10**-power} of "
            got = (
                f"{scale}that of {vehicle.name}, digit for digit, for {facts.mass:.4g} instead of {vehicle.mass:.5g} kg"
            )
            yield advice("copied", "inertia", "be the vehicle's own", got)
            return


def _moved(mine: np.ndarray, theirs: np.ndarray) -> tuple[int, ...]:
    """The power of ten between two matrices, if they differ by nothing else."""
    if not np.any(mine):
        return ()
    power = int(np.round(np.log10(np.abs(mine).max() / np.abs(theirs).max())))
    same = np.abs(mine - 10.0**power * theirs).max() < _DIGITS * np.abs(mine).max()
    plain = np.ptp(np.diag(theirs)) < 0.05 * np.abs(theirs).max()  # equal entries may agree by chance, if shifted
    return (power,) if same and not (plain and power) else ()


def _about_origin(facts: Facts) -> np.ndarray:
    return inertia_about_origin(facts.inertia, facts.mass, facts.r_g)


@functools.cache
def _known() -> tuple[Facts, ...]:
    return tuple(facts_of(part()) for part in catalogue.names("vehicles").values())


RULES = (copied,)
