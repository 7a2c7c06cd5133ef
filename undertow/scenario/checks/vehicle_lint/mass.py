"""Mass and inertia that are possible for a rigid body, and for one of this size."""

from collections.abc import Iterator

import numpy as np

from undertow.core.measurement import BODY_AXES
from undertow.physics.vehicles.facts import Facts
from undertow.scenario.checks.finding import Finding, advice, error

_AXES = BODY_AXES[3:]
# A uniform box has a radius of gyration of 0.58 of one with all its mass in the corners.
_USUAL = (0.25, 0.8)
_ORDER = "Are the axes forward, starboard, down, as `size` is length, width, height?"
# Without a size: of the longest thruster arm or the cube root of the volume, whichever is larger.
_USUAL_OF_SCALE = (0.05, 0.9)
# Of two moments of a uniform box; where they are nearer to each other, equipment decides which one is larger.
_CLEARLY_SMALLER = 0.8
# Units in which an inertia may be given by mistake, per kg m^2.
_UNITS = {1e3: "g m^2", 1e4: "kg cm^2", 1e6: "kg mm^2", 1e7: "g cm^2", 1e9: "g mm^2"}


def mass_matrix(facts: Facts) -> Iterator[Finding]:
    """M must be symmetric and positive definite: otherwise some force accelerates the vehicle backwards."""
    for key in ("inertia", "added_mass"):
        matrix = getattr(facts, key)
        skew = np.abs(matrix - matrix.T).max()
        if skew > 1e-9 * np.abs(matrix).max():
            hint = "Take (A + A^T) / 2 if this is rounding" if skew < 0.01 * np.abs(matrix).max() else ""
            yield error("symmetry", key, "be symmetric", f"off by {skew:.3g}", hint)
    total, rigid = (_smallest(matrix) for matrix in (facts.mass_matrix, facts.mass_matrix - facts.added_mass))
    if not total > 0 and rigid > 0:  # else it is the inertia, see `triangle`
        got = f"such that M, with it, has the eigenvalue {total:.3g}"
        hint = f"With mass and inertia alone the smallest is {rigid:.3g}"
        yield error("definite", "added_mass", "leave M = M_RB + M_A positive definite", got, hint)


def _smallest(matrix: np.ndarray) -> float:
    """Smallest eigenvalue of the symmetric part."""
    return float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min())


def triangle(facts: Facts) -> Iterator[Finding]:
    """About the centre of gravity no principal inertia exceeds the sum of the other two."""
    small, middle, large = np.linalg.eigvalsh(0.5 * (facts.inertia + facts.inertia.T))
    if not small > 0:
        hint = "Check `inertia_about` and r_g" if np.any(facts.r_g) else ""
        yield error(
            "triangle", "inertia", "be positive definite", f"one with principal inertia {small:.4g} kg m^2", hint
        )
    elif large > 1.001 * (small + middle):
        got = f"{large:.4g} against {small:.4g} + {middle:.4g} kg m^2"
        hint = "No distribution of mass has this. Is a sign of a product of inertia, or `inertia_about`, wrong?"
        yield error("triangle", "inertia", "have no principal value above the sum of the others", got, hint)


def gyration(facts: Facts) -> Iterator[Finding]:
    """The radius of gyration must fit the hull. Finds grams, centimetres and other vehicles' inertia."""
    radii = facts.radii_of_gyration
    if facts.size is None:
        limits = np.full(3, facts.scale)
        usual = _USUAL_OF_SCALE
        basis = "Thruster arms and volume make the vehicle"
    else:
        limits = _corner_radii(facts.size)
        usual = _USUAL
        basis = "All its mass in the corners of the hull would give"
    ratios = radii / limits
    i = int(np.argmax(np.maximum(ratios / usual[1], usual[0] / np.maximum(ratios, 1e-12))))
    smallest, largest = np.array(usual) * limits[i]
    got = f"one of {radii[i]:.3g} m"
    because = f"{basis} {limits[i]:.3g} m"
    if ratios[i] > (5 if facts.size is None else 1.02):
        must = f"give a radius of gyration below {limits[i]:.3g} m in {_AXES[i]}"
        yield error("gyration", "inertia", must, got, f"{because}. {_in_unit(ratios, usual)}")
    elif ratios[i] > usual[1]:
        should = f"give a radius of gyration below {largest:.3g} m in {_AXES[i]}"
        hint = f"{because}. {facts.mass * largest**2:.2g} kg m^2 is already much"
        yield advice("gyration", "inertia", should, got, hint)
    elif ratios[i] < usual[0]:
        should = f"give a radius of gyration above {smallest:.3g} m in {_AXES[i]}"
        yield advice("gyration", "inertia", should, got, f"{because}. Is the mass in grams?")


def _corner_radii(size: np.ndarray) -> np.ndarray:
    """Radii of gyration of a hull with all its mass in the corners, m; those of a uniform box are 0.58 of them."""
    return np.array([np.hypot(*np.delete(size, axis)) / 2 for axis in range(3)])


def axes(facts: Facts) -> Iterator[Finding]:
    """The moments of inertia must be in the order of those of a box of this size. Finds axes that are exchanged.

    Nothing is said of an inertia that is not that of the hull at all, see `gyration`.
    """
    if facts.size is None or any(gyration(facts)):
        return
    moments = np.diag(facts.inertia)
    box = _corner_radii(facts.size) ** 2
    pairs = [(box[i] / box[j], i, j) for i in range(3) for j in range(3) if 0 < moments[j] < moments[i]]
    ratio, i, j = min(pairs, default=(1.0, 0, 0))
    if ratio < _CLEARLY_SMALLER:
        should = f"be smaller in {_AXES[i]} than in {_AXES[j]}"
        got = f"{moments[i]:.4g} against {moments[j]:.4g} kg m^2"
        size = " x ".join(f"{side:.4g}" for side in facts.size)
        hint = f"In a uniform box of {size} m (`size`) it is {ratio:.2g} times as large. {_ORDER}"
        yield advice("axes", "inertia", should, got, hint)


def _in_unit(ratios: np.ndarray, usual: tuple[float, float]) -> str:
    """The unit in which these numbers would be usual."""
    for factor, unit in _UNITS.items():
        if np.all((ratios / np.sqrt(factor) > usual[0]) & (ratios / np.sqrt(factor) < usual[1])):
            return f"As numbers in {unit} they would fit: divide by {factor:g}"
    return "It is that of a larger vehicle"


RULES = (mass_matrix, triangle, gyration, axes)
