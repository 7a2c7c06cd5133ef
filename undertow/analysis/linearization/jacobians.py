"""Exact Jacobians of plant, controller and recorded signals of a closed loop at one instant.

Limits, dead zones, pulses of speed controllers and the sensor are left out: what is linearised is the loop inside its
limits, measured without error. The controller receives the input `u` that it believes to be applied, and the plant
gets the same.
"""

import dataclasses
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, PyTree

from undertow.analysis.theory import theory_of
from undertow.core.arrays import as_array
from undertow.core.contracts import AbstractContinuousController, Load, Target, Water
from undertow.core.kept_functions import for_each
from undertow.core.kept_programs import briefly_compiled
from undertow.core.measurement import with_outputs
from undertow.simulation.loop.closed_loop import ClosedLoop

Part = TypeVar("Part")

# Arguments of `Parts.values`, in this order; and which signals it gives, as far as the law has them.
INPUTS = ("plant", "law", "u", "load", "noise")
SIGNALS = ("error", "uncertainty", "estimate", "modelling_error", "robust_term")

Slopes = dict[str, dict[str, np.ndarray]]  # of what -> with respect to what


class Local(NamedTuple):
    """Values and derivatives of everything at one instant, by name."""

    values: dict[str, np.ndarray]
    slopes: Slopes


class Flow(NamedTuple):
    """Water that moves past a vehicle at rest."""

    velocity: Array  # m/s, world axes
    pushes: Array  # acceleration of the outputs that it causes there, m/s^2 and rad/s^2: a part of the load


class VectorLoop(eqx.Module):
    """A closed loop whose states are vectors.

    Attributes:
        loop: the five roles.
        plant_state, law_state: vectors back into the states of plant and law.
        sizes: length of each of `INPUTS`.
    """

    loop: ClosedLoop
    plant_state: Any
    law_state: Any
    sizes: tuple[int, ...]


class Parts(eqx.Module):
    """Such a loop about a constant reference.

    Attributes:
        vector_loop: the loop.
        target: constant reference.
        flow: of the water; None for a plant that is no vehicle.
    """

    vector_loop: VectorLoop
    target: Target
    flow: Flow | None = None

    @property
    def loop(self) -> ClosedLoop:
        """The five roles."""
        return self.vector_loop.loop

    @property
    def sizes(self) -> tuple[int, ...]:
        """Length of each of `INPUTS`."""
        return self.vector_loop.sizes

    def plant_state(self, vector: Array) -> Any:
        """State of the plant from its vector."""
        return self.vector_loop.plant_state(vector)

    def law_state(self, vector: Array) -> Any:
        """State of the law from its vector."""
        return self.vector_loop.law_state(vector)

    def differentiate(self, at: dict[str, Any], dt: float) -> Local:
        """Values and slopes where the states, the input, the load and the noise are as given, arrays by name.

        Args:
            at: vectors for `INPUTS`: states of plant and law; u; load, an acceleration of the outputs (m/s^2,
                rad/s^2); noise on position and velocity (m, rad, m/s, rad/s). What is missing is zero.
            dt: sampling time of the law, s.
        """
        point = [
            np.asarray(at.get(name, np.zeros(size)), dtype=float) for name, size in zip(INPUTS, self.sizes, strict=True)
        ]
        given = point, self.target, self.flow, dt
        values, slopes = for_each(_slope, self.vector_loop, given, np.eye(sum(self.sizes)))
        ends = np.cumsum([0, *self.sizes])
        columns = {name: slice(ends[i], ends[i + 1]) for i, name in enumerate(INPUTS)}
        slopes_by_input = {}
        for name, slope in slopes.items():
            slopes_by_input[name] = {by: slope.T[:, column] for by, column in columns.items()}
        return Local({name: value[0] for name, value in values.items()}, slopes_by_input)

    def pushed(self, load: Array) -> Load:
        """A load as an acceleration of the outputs (m/s^2, rad/s^2), as far as the water does not cause it."""
        unloaded = self.loop.plant.no_load()
        if self.flow is None:
            return unloaded._replace(acceleration=unloaded.acceleration + load)
        remaining = unloaded.acceleration + load - self.flow.pushes
        return _moved(unloaded, self.flow.velocity)._replace(acceleration=remaining)

    def states(self, at: dict[str, Any]) -> tuple[PyTree, PyTree]:
        """States of plant and law of a point."""
        return _states(self, as_array(at["plant"]), as_array(at["law"]))


def take_apart(loop: ClosedLoop, position: Any, flow: Any = None) -> tuple[Parts, dict[str, np.ndarray]]:
    """A closed loop about a constant reference, and its states at rest there as vectors (`plant` and `law`).

    A law that learns along a moving reference is taken without that: it adds nothing to the fast part of the loop, and
    has no equilibrium while it probes.

    Args:
        loop: the five roles.
        position: reference, m and rad.
        flow: velocity of the water past the vehicle, m/s, world axes; its forces change as the vehicle turns and moves.
            None for water at rest, which takes the same compiled program.
    """
    law = theory_of(loop.controller).at_rest
    loop = loop if law is None else dataclasses.replace(loop, controller=law)
    loop = without(loop, ("dead_zone",))  # inside a dead zone nothing has a slope
    position = as_array(position)
    still = as_array(np.zeros(position.shape))
    target = Target(position, still, still)
    x, z, vectors, flow_at_rest = _at_rest(loop, target, as_array(np.zeros(3) if flow is None else flow))
    at = {name: np.asarray(vector) for name, vector in vectors.items()}
    axes, inputs = position.shape[0], loop.plant.inputs()
    sizes = (at["plant"].size, at["law"].size, inputs, axes, 2 * axes)
    return Parts(VectorLoop(loop, _from_vector(x), _from_vector(z), sizes), target, flow_at_rest), at


@briefly_compiled
def _at_rest(loop: ClosedLoop, target: Target, velocity: Array):
    """States of plant and law, the same as vectors, and the flow."""
    plant, zero = loop.plant, jnp.zeros(())
    x, unloaded = plant.initial_state(target.position, target.velocity), plant.no_load()
    z = loop.controller.init(plant.output(zero, x), target)
    vectors = {"plant": ravel_pytree(x)[0], "law": ravel_pytree(z)[0]}
    if plant.pose(x) is None:
        return x, z, vectors, None
    pushed = lambda load: plant.acceleration(zero, x, jnp.zeros(plant.inputs()), load)
    return x, z, vectors, Flow(velocity, pushed(_moved(unloaded, velocity)) - pushed(unloaded))


def _from_vector(state: PyTree) -> Any:
    """Function that makes a state of this form from a vector."""
    functions = []
    jax.eval_shape(lambda state: functions.append(ravel_pytree(state)[1]), state)  # compiles nothing
    return functions[0]


@briefly_compiled
def _states(parts: Parts, plant: Array, law: Array) -> tuple[PyTree, PyTree]:
    return parts.plant_state(plant), parts.law_state(law)


def _moved(unloaded: Load, velocity: Array) -> Load:
    """The load of water that moves at a velocity, m/s, world axes."""
    return unloaded._replace(water=Water(velocity, jnp.zeros_like(velocity)))


def without(part: Part, parameters: tuple[str, ...]) -> Part:
    """Same loop, or part of one, with every parameter of these names at zero.

    Dead zones and resolutions have no slope.
    """
    is_listed = lambda key_path: getattr(key_path[-1], "name", "") in parameters
    return jax.tree_util.tree_map_with_path(
        lambda key_path, leaf: jnp.zeros_like(leaf) if is_listed(key_path) else leaf, part
    )


def _slope(vector_loop: VectorLoop, at: tuple[Any, ...], direction: Array) -> tuple[dict[str, Array], dict[str, Array]]:
    """Values at a point, and their slopes there along one direction of all `INPUTS` together.

    Args:
        vector_loop: the loop.
        at: `INPUTS`; target; flow; sampling time of the law, s.
        direction: a vector.
    """
    point, target, flow, dt = at
    parts, ends = Parts(vector_loop, target, flow), np.cumsum([0, *vector_loop.sizes])
    values = lambda vector: _values(parts, *(vector[ends[i] : ends[i + 1]] for i in range(len(INPUTS))), dt=dt)
    return jax.jvp(values, (jnp.concatenate(point),), (direction,))


def _values(parts: Parts, flat_x, flat_z, u, load, noise, dt) -> dict[str, Array]:
    """What follows from states, input, load and noise."""
    (plant, law), zero = (parts.loop.plant, parts.loop.controller), jnp.zeros(())
    x = parts.plant_state(flat_x)
    z = parts.law_state(flat_z)
    r = parts.target
    pushed = parts.pushed(load)
    truth, axes = plant.output(zero, x), load.shape[0]
    y = with_outputs(truth, truth.position + noise[:axes], truth.velocity + noise[axes:])
    command, of_law = law.command(z, y, r)
    values = {
        "plant": ravel_pytree(plant.dynamics(zero, x, u, pushed))[0],
        "law": ravel_pytree(law.advance(z, y, r, u, dt))[0],
        "u": command,
        "position": truth.position,
        "error": law.model.coordinates.difference(r.position, truth.position),
        "uncertainty": law.model.coordinates.acceleration(truth, plant.acceleration(zero, x, u, pushed))
        - law.known_acceleration(z, truth, u),
    }
    values |= {name: of_law[name] for name in SIGNALS if name in of_law}
    if isinstance(law, AbstractContinuousController):
        values["flow"] = ravel_pytree(law.flow(z, y, r, u))[0]
    return values
