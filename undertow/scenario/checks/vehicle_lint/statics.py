"""Statics: weight, buoyancy and their centres."""

from collections.abc import Iterator

import numpy as np

from undertow.physics.vehicles.facts import FRESH_WATER, Facts
from undertow.scenario.checks.finding import Finding, advice, error

_EARTH = (9.76, 9.84)  # m/s^2, from the equator to the poles, rounded outward
_MOST_TRIM = 10.0  # degrees


def gravity(facts: Facts) -> Iterator[Finding]:
    """W = m g with the gravity of the earth."""
    g = facts.weight / facts.mass
    expected = facts.mass * 9.81
    got = f"{facts.weight:.5g} N, {g:.4g} m/s^2 times {facts.mass:.4g} kg"
    should = f"be the weight of the mass, {expected:.4g} N"
    if not 0.97 * _EARTH[0] < g < 1.03 * _EARTH[1]:
        hints = {
            1e-3: "Is `mass` in grams?",
            0.102: "Is `weight` in kg?",
            1e3: "Is `weight` in mN, or `mass` in tonnes?",
        }
        near = [hint for factor, hint in hints.items() if abs(np.log(g / 9.81 / factor)) < 0.1]
        alternative = "Does `buoyancy` fit better? Then the two are swapped, or `mass` belongs to another version"
        yield error("gravity", "weight", should, got, near[0] if near else alternative)
    elif not _EARTH[0] < g < _EARTH[1]:
        yield advice("gravity", "weight", should, got)


def balance(facts: Facts) -> Iterator[Finding]:
    """Buoyancy is near the weight, preferably above it."""
    net = facts.buoyancy - facts.weight
    share = net / facts.weight
    got = (
        f"{facts.buoyancy:.5g} N, {abs(net):.4g} N {'above' if net > 0 else 'below'} the weight ({100 * share:+.1f} %)"
    )
    radius = np.cbrt(facts.mass / FRESH_WATER / (4 / 3 * np.pi))
    if not -0.5 < share < 1.0:
        hint = "Is one of them in kg, or the volume in litres?"
        yield error("balance", "buoyancy", "be of the order of the weight", got, hint)
    elif abs(share) > 0.05:
        hint = (
            f"Neutral in fresh water is {1e3 * facts.mass / FRESH_WATER:.4g} litres; as a sphere, radius {radius:.3g} m"
        )
        yield advice("balance", "buoyancy", "be within 5 % of the weight", got, hint)
    elif share < -0.01:
        hint = "It sinks when the power fails. Are weight and buoyancy swapped?"
        yield advice("balance", "buoyancy", "rather be above the weight", got, hint)


def volume(facts: Facts) -> Iterator[Finding]:
    """The displaced volume must fit the hull, and fill a part of it."""
    if facts.size is None:
        return
    box = float(np.prod(facts.size))
    displaced = facts.displaced_mass / (facts.water_density or FRESH_WATER)
    got = f"a box of {box:.3g} m^3, where the vehicle displaces {displaced:.3g} m^3"
    if displaced > 1.05 * box:
        yield error("volume", "size", "hold the displaced water", got, "Is `size` in metres?")
    elif displaced < 0.02 * box:
        yield error("volume", "size", "be filled by the vehicle to some extent", got, "Is `size` in metres?")


def uprightness(facts: Facts) -> Iterator[Finding]:
    """The centre of buoyancy is above the centre of gravity, by less than the height of the hull."""
    above = float(facts.r_g[2] - facts.r_b[2])
    height = facts.scale if facts.size is None else float(facts.size[2])
    of = "size from thruster arms and volume" if facts.size is None else "height of the hull"
    got = f"{_millimetres(abs(above))} {'above' if above > 0 else 'below'} it"
    if above < -0.02 * height:
        hint = "z points down: a centre of buoyancy above the origin has a negative z"
        yield error("upright", "r_b", "be above the centre of gravity", got, hint)
    elif above <= 0:
        yield advice("upright", "r_b", "be above the centre of gravity", got, "Nothing rights it in roll and pitch")
    elif facts.size is not None and above > height:
        hint = "One of the two is outside. Is it another vehicle's, or in another unit?"
        yield error(
            "upright",
            "r_b",
            "be at most the height of the hull above the centre of gravity",
            f"{got}, in a hull {_millimetres(height)} high",
            hint,
        )
    elif above > 0.3 * height:
        hint = f"More than 30 % of the {of} ({_millimetres(height)}) is rare"
        yield advice("upright", "r_b", "be nearer to the centre of gravity", got, hint)


def trim(facts: Facts) -> Iterator[Finding]:
    """The vehicle should float level."""
    moment = facts.weight * facts.r_g - facts.buoyancy * facts.r_b
    angle = np.degrees(np.arctan2(np.hypot(moment[0], moment[1]), abs(moment[2])))
    if angle > _MOST_TRIM:
        got = f"such that it floats {angle:.3g} degrees off level"
        yield advice("trim", "r_g", "be below the centre of buoyancy", got)


def _millimetres(length: float) -> str:
    return f"{1e3 * length:.4g} mm"


RULES = (gravity, balance, volume, uprightness, trim)
