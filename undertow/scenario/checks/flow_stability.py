"""Whether a loop is fast enough for its vehicle in the water that passes it, before a run.

Drag and added mass turn a slender or box-shaped vehicle across the flow (the Munk moment): in a current,
or under way, its attitude is unstable by itself, the faster the flow. A slow loop cannot turn it back.
"""

import dataclasses
from collections.abc import Mapping

import numpy as np

from undertow.analysis.linearization import margins
from undertow.analysis.linearization.disturbance_profile import disturbance_profile
from undertow.analysis.linearization.equilibrium import equilibrium
from undertow.control.navigation.perfect import perfect
from undertow.core import catalogue
from undertow.core.arrays import as_array
from undertow.core.errors import Advice, BadInput, advice, error_location
from undertow.core.numerics.random_keys import key_of_seed
from undertow.physics.plants import HybridVehicle
from undertow.physics.vehicles.body import Body
from undertow.scenario.build import Built, build_scenario, in_its_precision

# What a loop turns back by far: growth of the attitude in this flow (m/s) within one sampling time.
_FLOW, _LITTLE_GROWTH = 1.0, 0.12
_HARMLESS = 0.4  # growth of errors, 1/s: runs whose errors grow more slowly in a fast flow stay near their reference
_GROWN = 5.0  # logarithm of the growth over a run in a flow that stays, from which on it is worth a word
_FASTER = (2, 4, 8)  # times the rate of the scenario
_LOOKS = 2000  # along the reference


def flow_advice(built: Built) -> tuple[Advice, ...]:
    """Advice where the sampled loop of a vehicle is unstable in the fast flow along its reference.

    Loops that are fast enough for any usual flow are not looked at: that would take seconds.
    """
    return _slow_loop_advice(built, *_in_fast_flow(built)) if _is_slow(built) else ()


def checked_flow_advice(built: Built) -> tuple[Advice, ...]:
    """Like `flow_advice`, and advice where gains are not those of the rule and the loop is too slow for them.

    These are gains that a scenario gives, and those of a law in a file of the user's. It takes seconds, and is for
    checks: the rule for gains is safe at all rates where `flow_advice` says nothing.
    """
    given = built.text.data.get("controller")
    gives_gains = isinstance(given, Mapping) and bool(set(given) - {"kind", "preset"})
    is_own_law = catalogue.is_user_code(built.resolved["controller"]["kind"])
    if not (gives_gains or is_own_law) or _sampled_vehicle(built) is None:
        return flow_advice(built)
    flow, growth = _in_fast_flow(built)
    rate_advice = _slow_loop_advice(built, flow, growth) if _is_slow(built) else ()
    return rate_advice or _given_gains_advice(built, flow, growth, is_own_law)


def _is_slow(built: Built) -> bool:
    """Whether the attitude of a vehicle can grow by much in a fast flow within one sampling time."""
    vehicle = _sampled_vehicle(built)
    return vehicle is not None and munk_rate(vehicle.body) * _FLOW * built.scenario.loop.dt >= _LITTLE_GROWTH


def _sampled_vehicle(built: Built) -> HybridVehicle | None:
    """The vehicle of a sampled loop; None where there is none."""
    plant = built.closed_loop.plant
    return plant if built.scenario.loop.kind == "sampled" and isinstance(plant, HybridVehicle) else None


def _slow_loop_advice(built: Built, flow: float, growth: float) -> tuple[Advice, ...]:
    """Advice on the rate, for errors that grow by `growth` (1/s) in a flow of `flow` (m/s)."""
    if not _HARMLESS < growth < np.inf:
        return ()
    message = (
        f"at {1 / built.scenario.loop.dt:g} Hz the loop is unstable while the water passes the vehicle at "
        f"{flow:.2g} m/s: errors grow by {growth:.2g} 1/s"
    )
    with error_location(location=built.text.location):
        return (advice("loop.dt", message, _remedy(built)),)


def _given_gains_advice(built: Built, flow: float, growth: float, is_own_law: bool) -> tuple[Advice, ...]:
    """Advice on gains, for errors that grow by `growth` (1/s) in a flow of `flow` (m/s)."""
    if not _GROWN / built.scenario.loop.duration < growth < np.inf:
        return ()
    message = (
        f"with these gains the loop is unstable while the water passes the vehicle at {flow:.2g} m/s: errors grow by "
        f"{growth:.2g} 1/s"
    )
    hint = "`undertow tune` finds others"
    if not is_own_law:
        hint += "; without any, they follow from the vehicle and the rate"
    with error_location(location=built.text.location):
        return (advice("controller", message, hint),)


def munk_rate(body: Body) -> float:
    """Largest rate at which a flow turns a vehicle without drag and weight across itself, 1/s per m/s of the flow.

    The moment is that of unequal masses (with added mass) along two axes, Fossen (2021), section 6.3; the third is that
    of the turn.
    """
    mass = np.diagonal(np.asarray(body.mass_matrix))
    unequal = np.array([abs(mass[1] - mass[2]), abs(mass[2] - mass[0]), abs(mass[0] - mass[1])])
    return float(np.sqrt(unequal / mass[3:]).max())


def _remedy(built: Built) -> str:
    """The rate that the vehicle needs, where one is found."""
    settings = built.scenario.loop
    for times in _FASTER:
        faster = settings.model_copy(update={"dt": settings.dt / times})
        try:
            faster_built = build_scenario(built.scenario.model_copy(update={"loop": faster}), built.text)
        except BadInput:  # other times of the scenario may not be multiples of this one
            continue
        if _in_fast_flow(faster_built)[1] <= _HARMLESS:
            return f"{times / settings.dt:g} Hz is enough; a slower motion or a weaker current helps as well"
    return "A faster loop alone does not help: use other gains, a nearer nominal model, or a weaker current"


@in_its_precision
def _in_fast_flow(built: Built) -> tuple[float, float]:
    """Speed of a flow that is fast along the reference, m/s, and how fast errors grow in it, 1/s.

    That is infinite where the loop has no equilibrium or no slopes, which the rate does not change.
    """
    try:
        return _growth(built)
    except Exception:  # a user's part may run and yet not be differentiable, which `analyze` says
        return np.nan, np.inf


def _growth(built: Built) -> tuple[float, float]:
    settings = built.scenario.loop
    loop = dataclasses.replace(built.of_the_law().closed_loop, navigation=perfect())
    position = np.asarray(loop.reference.at(as_array(settings.duration / 2)).position)
    at_rest = equilibrium(loop, settings.dt, position, np.zeros_like(position))
    interval = max(settings.dt, settings.duration / _LOOKS)
    profile = disturbance_profile(
        loop, at_rest, key_of_seed(built.scenario.seed), int(settings.duration / interval), interval
    )
    operating_point = profile.operating_points(())[-1]
    assert operating_point.flow is not None
    radius = margins.certify(loop, settings.dt, position, [operating_point])[0]
    return float(np.linalg.norm(operating_point.flow)), float(np.log(radius) / settings.dt)
