"""Does a part keep its contract? It is used once, as the loop would use it, and its answers are compared."""

from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from undertow.analysis.finding import Finding, error
from undertow.core.contracts import (
    AbstractController,
    AbstractDisturbance,
    AbstractPlant,
    AbstractReference,
    Load,
    Measurement,
    Place,
    Target,
)

_TOLERANCE = 1e-6
_TIMES = (0.37, 1.93, 7.1)  # s; away from round numbers, where references may turn


def check_contract(part: Any) -> tuple[Finding, ...]:
    """What a part does that its contract does not allow; nothing for kinds whose contract is their data."""
    for kind, use in _USES.items():
        if isinstance(part, kind):
            try:
                return tuple(use(part))
            except Exception as complaint:
                got = f"not: {type(complaint).__name__}: {' '.join(str(complaint).split())[:80]}"
                return (error("contract", type(part).__name__, "be usable as its contract says", got),)
    return ()


def _plant(plant: AbstractPlant) -> Iterator[Finding]:
    n, m, t, calm = len(plant.outputs), plant.inputs(), jnp.zeros(()), plant.no_load()
    x = plant.initial_state(jnp.linspace(0.1, 0.5, n), jnp.linspace(0.2, -0.1, n))
    u = plant.admissible(x, jnp.full(m, 0.1))
    rate = plant.dynamics(t, x, u, calm)
    yield from _like("dynamics", rate, x, "have the form of the state")
    yield from _shaped("admissible", u, (m,))
    yield from _shaped("acceleration", plant.acceleration(t, x, u, calm), (n,))
    y, y_rate = jax.jvp(lambda x: plant.output(t, x)[:2], (x,), (rate,))
    yield from _equal("output", y[1], y_rate[0], "the rate of its position")
    yield from _equal("acceleration", plant.acceleration(t, x, u, calm), y_rate[1], "the rate of the output")


def _controller(controller: AbstractController) -> Iterator[Finding]:
    n = len(controller.model.angles)
    y = Measurement(0.1 * jnp.ones(n), jnp.zeros(n))
    r = Target(jnp.zeros(n), jnp.zeros(n), jnp.zeros(n))
    z = controller.init(y, r)
    u, telemetry = controller.command(z, y, r)
    yield from _shaped("command", u, (controller.model.gain(y).shape[1],))
    yield from _shaped("command", telemetry.estimate, (n,))
    yield from _like("advance", controller.advance(z, y, r, u, jnp.asarray(1e-3)), z, "have the form of the state")


def _disturbance(disturbance: AbstractDisturbance) -> Iterator[Finding]:
    calm = Load(jnp.zeros(6), jnp.zeros(6))
    place = Place(jnp.zeros(3), jnp.eye(3), jnp.zeros(3))
    path = disturbance.draw(jax.random.PRNGKey(0))
    yield from _like("draw", disturbance.draw(jax.random.PRNGKey(0)), path, "give the same path for the same key", True)
    for t in _TIMES:
        load = disturbance.at(path, jnp.asarray(t), place, calm)
        yield from _shaped("at", load.acceleration, (6,))
        yield from _shaped("at", load.wrench, (6,))
    if not all(0 < jump < 10 for jump in disturbance.jumps(10.0)):
        yield error("contract", "jumps", "be times between 0 and the duration", str(disturbance.jumps(10.0)))


def _reference(reference: AbstractReference) -> Iterator[Finding]:
    for t in map(jnp.asarray, _TIMES):
        target, rate = jax.jvp(lambda t: tuple(reference.at(t)), (t,), (jnp.ones(()),))
        for value in target:
            yield from _shaped("at", value, target[0].shape)
        yield from _equal("at", target[1], rate[0], f"the rate of the position at {t:g} s")
        yield from _equal("at", target[2], rate[1], f"the rate of the velocity at {t:g} s")


_USES: dict[type, Callable[[Any], Iterator[Finding]]] = {
    AbstractPlant: _plant,
    AbstractController: _controller,
    AbstractDisturbance: _disturbance,
    AbstractReference: _reference,
}


def _shaped(name: str, value: Any, shape: tuple[int, ...]) -> Iterator[Finding]:
    if jnp.shape(value) != shape:
        yield error("contract", name, f"give arrays of shape {shape}", f"of shape {jnp.shape(value)}")
    elif not np.all(np.isfinite(value)):
        yield error("contract", name, "give finite numbers", str(np.asarray(value)))


def _like(name: str, value: Any, model: Any, must: str, equal: bool = False) -> Iterator[Finding]:
    forms = [jax.tree.structure(tree) for tree in (value, model)]
    shapes = [[jnp.shape(leaf) for leaf in jax.tree.leaves(tree)] for tree in (value, model)]
    if forms[0] != forms[1] or shapes[0] != shapes[1]:
        yield error("contract", name, must, f"of shapes {shapes[0]} instead of {shapes[1]}")
    elif equal:
        pairs = zip(jax.tree.leaves(value), jax.tree.leaves(model), strict=True)
        if not all(np.array_equal(a, b) for a, b in pairs):
            yield error("contract", name, must, "another one")


def _equal(name: str, value: Any, other: Any, what: str) -> Iterator[Finding]:
    off = np.abs(np.asarray(value) - np.asarray(other))
    scale = max(1.0, float(np.abs(np.asarray(other)).max(initial=0.0)))
    if off.max(initial=0.0) > _TOLERANCE * scale:
        i = int(off.argmax())
        got = f"{np.ravel(value)[i]:.6g} instead of {np.ravel(other)[i]:.6g} in entry {i + 1}"
        yield error("contract", name, f"agree with {what}", got)
