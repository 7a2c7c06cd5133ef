"""Inertia copied from another vehicle: the same digits, perhaps with a shifted decimal point."""

import functools
from collections.abc import Iterator

import numpy as np

from undertow.checks.finding import Finding, advice
from undertow.core import catalogue
from undertow.vehicles.facts import Facts, facts_of
from undertow.vehicles.published import inertia_about_origin

_DIGITS = 1e-3  # of the largest entry
_OTHER_MASS = 0.1  # relative; a vehicle of the same mass may have the same inertia


def copied(facts: Facts) -> Iterator[Finding]:
    """Compare with every vehicle of the catalogue, about the centre of gravity and about the origin."""
    for other in _known():
        if abs(facts.mass / other.mass - 1) < _OTHER_MASS:
            continue
        pairs = (facts.inertia, other.inertia), (_about_origin(facts), _about_origin(other))
        for power in (power for pair in pairs for power in _moved(*pair)):
            scale = "" if power == 0 else f"{10**power} times " if power > 0 else f"1/{10**-power} of "
            got = f"{scale}that of {other.name}, digit for digit, for {facts.mass:.4g} instead of {other.mass:.5g} kg"
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
