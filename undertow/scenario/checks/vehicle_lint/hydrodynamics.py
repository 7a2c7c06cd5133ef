"""Added mass and damping: signs, zeros, and dissipation."""

from collections.abc import Iterator

import numpy as np

from undertow.core.measurement import BODY_AXES
from undertow.physics.vehicles.facts import FRESH_WATER, Facts
from undertow.scenario.checks.finding import Finding, advice, error

_SAMPLES = 4000
_SPHERE = 0.5  # added mass of a sphere per displaced mass
_MOST_ADDED = 5.0  # added per displaced mass; only a flat plate broadside has more


def added_mass(facts: Facts) -> Iterator[Finding]:
    """Added mass is positive along every axis."""
    diagonal = np.diag(facts.added_mass)
    if np.any(diagonal < 0):
        hint = "Published derivatives such as X_udot are negative; undertow wants M_A = -X_udot: reverse the signs"
        yield error("added_mass_sign", "added_mass", "be positive", _shown(diagonal, diagonal < 0), hint)
        return
    if not np.any(facts.added_mass):
        hint = f"Of the displaced {facts.displaced_mass:.3g} kg a sphere has half, a box about all"
        yield advice("no_added_mass", "added_mass", "not be zero", "zero in every direction", hint)
        return
    zero = diagonal == 0
    if _is_of_sphere(facts):
        yield from _sphere(facts)
    elif np.any(zero):
        hint = "Only turning a body of revolution about its axis moves no water"
        yield advice("no_added_mass", "added_mass", "have no zero on its diagonal", _shown(diagonal, zero), hint)
    share = diagonal[:3].max() / facts.displaced_mass
    if share > _MOST_ADDED:
        got = f"{diagonal[:3].max():.4g} kg, {share:.3g} times the displaced {facts.displaced_mass:.4g} kg"
        yield advice("added_mass_size", "added_mass", f"be below {_MOST_ADDED:g} times the displaced mass", got)


def damping_sign(facts: Facts) -> Iterator[Finding]:
    """Damping is positive."""
    for key in ("linear_damping", "quadratic_damping"):
        diagonal = np.diag(getattr(facts, key))
        if np.any(diagonal < 0):
            hint = "Published derivatives such as X_u are negative; undertow wants D = -X_u: reverse the signs"
            yield error("damping_sign", key, "be positive", _shown(diagonal, diagonal < 0), hint)


def dissipation(facts: Facts) -> Iterator[Finding]:
    """nu . D(nu) nu is not negative for any motion; sampled over directions and speeds."""
    linear, quadratic = facts.linear_damping, facts.quadratic_damping
    if np.any(np.diag(linear) < 0) or np.any(np.diag(quadratic) < 0):
        return  # reported already
    rng = np.random.default_rng(0)
    nu = rng.normal(size=(_SAMPLES, 6)) * np.where(rng.random((_SAMPLES, 6)) < 0.5, 0.0, 1.0)
    nu *= np.array([1, 1, 1, *np.full(3, 1 / facts.scale)])
    for key, speeds in (("linear_damping", nu), ("quadratic_damping", np.abs(nu) * nu)):
        matrix = linear if key == "linear_damping" else quadratic
        power = np.einsum("ki,ij,kj->k", nu, matrix, speeds)
        against = np.einsum("ki,ij,kj->k", np.abs(nu), np.abs(matrix), np.abs(speeds))
        share = power / np.maximum(against, 1e-300)
        worst = int(np.argmin(share))
        if share[worst] < -1e-6:
            speed = ", ".join(f"{v:.2g}" for v in nu[worst])
            got = f"giving {-power[worst]:.3g} W to the vehicle at nu = ({speed})"
            hint = "A coupling term has the wrong sign or is too large"
            yield error("dissipation", key, "take power from every motion", got, hint)


def undamped(facts: Facts) -> Iterator[Finding]:
    """Every motion is damped."""
    undamped_axes = (np.diag(facts.linear_damping) == 0) & (np.diag(facts.quadratic_damping) == 0)
    if np.any(undamped_axes):
        got = f"zero, like the linear one, in {_names(undamped_axes)}"
        yield advice("undamped", "quadratic_damping", "slow every motion", got)


def _is_of_sphere(facts: Facts) -> bool:
    diagonal = np.diag(facts.added_mass)
    coupled = np.any(facts.added_mass - np.diag(diagonal))
    return (
        not coupled
        and bool(np.ptp(diagonal[:3]) <= 1e-6 * diagonal[0])
        and diagonal[0] > 0
        and not np.any(diagonal[3:])
    )


def _sphere(facts: Facts) -> Iterator[Finding]:
    """Equal added mass along all axes and none in rotation is that of a sphere: then size and mass must fit one."""
    mass = facts.added_mass[0, 0]
    half = _SPHERE * facts.displaced_mass
    if abs(mass / half - 1) > 0.05:
        got = f"{mass:.4g} kg, where half the displaced mass is {half:.4g} kg"
        radius = np.cbrt(2 * mass / FRESH_WATER / (4 / 3 * np.pi))
        hint = f"In fresh water that is a sphere of radius {radius:.3g} m"
        yield advice("sphere", "added_mass", "be half the displaced mass, if this is a sphere", got, hint)
    if facts.size is not None and np.ptp(facts.size) > 0.2 * facts.size.max():
        got = f"{' x '.join(f'{side:.3g}' for side in facts.size)} m, with the added mass of a sphere"
        yield advice("sphere", "size", "fit the added mass", got, "Is `added_mass` that of another vehicle?")


def _shown(values: np.ndarray, which: np.ndarray) -> str:
    if not np.any(values[which]):
        return f"zero in {_names(which)}"
    return ", ".join(f"{values[i]:.4g} in {BODY_AXES[i]}" for i in np.flatnonzero(which))


def _names(which: np.ndarray) -> str:
    return ", ".join(BODY_AXES[i] for i in np.flatnonzero(which))


RULES = (added_mass, damping_sign, dissipation, undamped)
