"""Logs of simulated dives whose thrusters jump at random, with a vehicle whose numbers are known."""

import jax.numpy as jnp
import numpy as np

from undertow.studies.identification.identified_vehicle import prior_vehicle
from undertow.studies.identification.simulated_dive import simulated_log, telegraph_wrenches

AMPLITUDES = np.array([25.0, 25.0, 25.0, 3.0, 3.0, 5.0])  # N, N m


def telegraph_dive(plant, truth, seed, duration=60.0, **options):
    """The log of a dive: `truth` are the parameters that differ from those of the plant."""
    generator = np.random.default_rng(seed)
    inverse = np.linalg.pinv(np.asarray(plant.thruster_matrix))
    thrust = telegraph_wrenches(generator, duration, AMPLITUDES) @ inverse.T
    volts = np.clip(2.3 * np.sign(thrust) * np.sqrt(np.abs(thrust)), -16, 16)
    vehicle = prior_vehicle(plant).with_values({name: jnp.asarray(value) for name, value in truth.items()})
    return simulated_log(vehicle, volts, generator, **options)
