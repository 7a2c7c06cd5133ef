"""Stability of fixed integration steps: for the thrusters before a run, for the whole loop after a failed run."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from undertow.core.errors import Advice, advice
from undertow.core.kept_programs import briefly_compiled
from undertow.core.status import Status
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.physics.vehicles.body import Body
from undertow.scenario.schema import ClosedLoopSettings
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.continuous import flow
from undertow.simulation.loop.outcome import Outcome

# Largest step times decay rate at which a method is stable.
_LIMITS = {"rk4": 2.785, "euler": 2.0}

# Number of records of a failed run that are examined.
_LOOKS = 9


def step_advice(plant: HybridVehicle, loop: ClosedLoopSettings) -> tuple[Advice, ...]:
    """Advice when steps are too long for the linearised thrusters at rest, or for the linear damping of the hull."""
    if loop.method not in _LIMITS:
        return ()
    step = loop.dt / loop.substeps
    rates = {"thrusters have": fastest_decay(plant.thruster), "hull has, by its damping,": _hull_decay(plant.body)}
    name, rate = max(rates.items(), key=lambda item: item[1])
    longest = _LIMITS[loop.method] / rate if rate else np.inf
    if step <= longest:
        return ()
    message = (
        f"the {name} a time constant of {1e3 / rate:.3g} ms, for which integration steps above {1e3 * longest:.3g} ms "
        f"are unstable, but the step is {1e3 * step:g} ms: the run will diverge numerically"
    )
    alternative = ", or another fidelity level" if name.startswith("thrusters") else ""
    return (advice("loop.dt", message, f"Use {_remedy(loop, longest)}{alternative}"),)


def _hull_decay(body: Body) -> float:
    """Fastest decay of the velocities of a hull by its linear damping, 1/s."""
    decays = np.linalg.eigvals(np.asarray(body.inverse_mass_matrix) @ np.asarray(body.linear_damping))
    return float(np.abs(decays).max())


def _remedy(loop: ClosedLoopSettings, longest: float) -> str:
    """A setting with steps of at most `longest` seconds."""
    if loop.kind == "continuous":
        return f"a loop.dt of at most {longest:.2g} s"
    return f"loop.substeps: {int(np.ceil(loop.dt / longest))} or more"


def fastest_decay(thruster: AbstractThruster) -> float:
    """Fastest decay of a thruster at rest, 1/s; 0 for one without a state."""
    slopes = np.asarray(_slopes_at_rest(thruster))
    return float(np.abs(np.linalg.eigvals(slopes)).max(initial=0.0))


@briefly_compiled
def _slopes_at_rest(thruster: AbstractThruster):
    state, tree = ravel_pytree(thruster.initial_state(1))
    return jax.jacfwd(lambda x: ravel_pytree(thruster.dynamics(tree(x), jnp.zeros(1)))[0])(state)


def step_failure(closed_loop: ClosedLoop, loop: ClosedLoopSettings, outcome: Outcome) -> str:
    """The reason of a failed run if its integration steps were too long; empty if that is not the cause.

    A sampled run integrates the plant, a continuous run the controller with it. The loop is linearised at the start and
    at further records before the plant moved unusually fast: quadratic drag makes any diverging plant fast.
    """
    failed = Status(int(outcome.status)) in (Status.DIVERGED, Status.NOT_FINITE)
    if not failed or loop.method not in _LIMITS:
        return ""
    rate = max(_decays(closed_loop, loop, outcome), default=0.0)
    step = loop.dt / loop.substeps
    longest = _LIMITS[loop.method] / rate if rate else np.inf
    if loop.kind == "continuous":
        step = loop.dt
    if step <= longest:
        return ""
    what = "plant and controller have" if loop.kind == "continuous" else "the plant has"
    return (
        f"The run diverged numerically, not because the loop is unstable: {what} a time constant of {1e3 / rate:.3g} "
        f"ms, for which steps of {loop.method} above {1e3 * longest:.3g} ms are unstable, but the step is "
        f"{1e3 * step:g} ms. Use {_remedy(loop, longest)}."
    )


def _decays(closed_loop: ClosedLoop, loop: ClosedLoopSettings, outcome: Outcome) -> list[float]:
    """Fastest decay rates at some records, 1/s, without those where the fastest mode grows."""
    plant, samples = closed_loop.plant, outcome.signals
    ordinary = np.abs(np.asarray(samples["velocity"])).max(axis=1) <= _ordinary(closed_loop, outcome)
    rows = np.flatnonzero(ordinary & (np.asarray(outcome.time) <= float(outcome.ended)))
    sampled_rows = rows[np.unique(np.linspace(0, len(rows) - 1, _LOOKS).round().astype(int))] if len(rows) else []
    first = plant.initial_state(samples["position"][0], samples["velocity"][0])
    if loop.kind == "continuous":
        realization = closed_loop.realize(jax.random.PRNGKey(0))
        flat, tree = ravel_pytree(realization.start(samples["position"][0], samples["velocity"][0]))
        rates = lambda state: ravel_pytree(flow(jnp.zeros(()), tree(state), realization))[0]
        return _fastest(rates, [(flat,)])
    _, tree = ravel_pytree(first)
    no_load = plant.no_load()
    rates = lambda state, u: ravel_pytree(plant.dynamics(jnp.zeros(()), tree(state), u, no_load))[0]
    states = [
        ravel_pytree(plant.initial_state(samples["position"][i], samples["velocity"][i]))[0] for i in sampled_rows
    ]
    return _fastest(rates, [(state, samples["input"][i]) for state, i in zip(states, sampled_rows, strict=True)])


def _ordinary(closed_loop: ClosedLoop, outcome: Outcome) -> float:
    """Largest usual speed, m/s or rad/s: a few times that of the reference or of the start."""
    times = np.linspace(0.0, float(outcome.ended), _LOOKS)
    desired = np.abs([np.asarray(closed_loop.reference.at(jnp.asarray(t)).velocity) for t in times]).max()
    return max(1.0, 3 * float(desired), 1.5 * float(np.abs(np.asarray(outcome.signals["velocity"][0])).max()))


def _fastest(rates: Callable[..., Any], points: list[tuple[Any, ...]]) -> list[float]:
    """Fastest decay rate at each point, without points where the fastest mode grows."""
    slopes, rates_of_decay = jax.jit(jax.jacfwd(rates)), []
    for point in points:
        matrix = np.asarray(slopes(*map(jnp.asarray, point)))
        if np.isfinite(matrix).all():
            poles = np.linalg.eigvals(matrix)
            fastest = poles[np.abs(poles).argmax()]
            rates_of_decay += [float(abs(fastest))] if fastest.real < 0 else []
    return rates_of_decay
