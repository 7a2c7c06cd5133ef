"""Steady forces that the actuators can hold, compared with the demand of loads and nominal model."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.analysis.linearization.equilibrium import Equilibrium
from undertow.control.controllers.thruster_allocation import allocate, attained
from undertow.core.kept_programs import briefly_compiled
from undertow.simulation.loop.closed_loop import ClosedLoop

_SETTLING, _STEP = 800, 5e-3  # steps and s that an actuator is given to come to its limit
_WHOLE = 1e6  # weight of the direction: what is held is held in full proportion
_LOOKED_AT = 400  # loads, evenly over the run


class ActuatorAuthority(NamedTuple):
    """Demand against what there is.

    Attributes:
        low, high: forces of the actuators at the limits of their input, settled; in the unit of the force.
        demand: largest force of each actuator that a load asks for, as if there were no limits.
        share: of the demanded acceleration that is given, one entry per load that was looked at.
    """

    low: np.ndarray
    high: np.ndarray
    demand: np.ndarray
    share: np.ndarray

    @property
    def held(self) -> float:
        """Share of the loads that are held whole."""
        return float((self.share > 1 - 1e-6).mean())


def actuator_authority(loop: ClosedLoop, at: Equilibrium, loads: np.ndarray) -> ActuatorAuthority:
    """What the loads (accelerations of the outputs, one per row) ask of the actuators where the loop rests."""
    x, _ = at.parts.states(at.at)
    sampled_loads = loads[np.unique(np.linspace(0, len(loads) - 1, _LOOKED_AT).round().astype(int))]
    authority = _reach(loop, x, jnp.asarray(sampled_loads))
    return ActuatorAuthority(*map(np.asarray, authority))


@briefly_compiled
def _reach(loop: ClosedLoop, x, loads):
    plant, (dynamics, coordinates, drive) = loop.plant, loop.controller.model.in_body_axes()
    y = plant.output(jnp.zeros(()), x)
    effect = dynamics.gain(y)
    inputs = jnp.zeros(plant.inputs())

    def at_limit(side):
        limit = plant.admissible(x, side * jnp.full_like(inputs, 1e9))
        bounded = jnp.abs(limit) < 1e8
        u = jnp.where(bounded, limit, 0.0)
        state = jax.lax.fori_loop(
            0, _SETTLING, lambda _, state: drive.advance(state, u, jnp.asarray(_STEP)), drive.init()
        )
        return jnp.where(bounded, drive.force(state, u), side * jnp.inf)

    low, high = at_limit(-1.0), at_limit(1.0)

    def required(load):
        load_acceleration = coordinates.acceleration(y, load) - coordinates.acceleration(y, jnp.zeros_like(load))
        return dynamics.invert(y, -dynamics.drift(y) - load_acceleration)

    forces = jax.vmap(required)(loads)
    allocated = jax.vmap(lambda force: allocate(effect, force, low, high, jnp.asarray(_WHOLE)))(forces)
    share = jax.vmap(lambda force, allocated: attained(effect, force, allocated))(forces, allocated)
    return low, high, jnp.abs(forces).max(axis=0), share
