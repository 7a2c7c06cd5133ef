"""An experiment in simulation: with the vehicle of the file, or with another one within its deviations."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built
from undertow.scenario.results.run_scenario import run_scenario
from undertow.studies.identification.dive_information import SimulatedDive, dive_of_run
from undertow.studies.identification.experiment_scenario import LEAD, ExperimentLimits
from undertow.studies.identification.identified_vehicle import ThrusterActuation
from undertow.studies.identification.model import CandidateVehicle, IdentificationModel


class Rehearsal(NamedTuple):
    """A simulated experiment.

    Attributes:
        time: of the records, s.
        away: from the station: along its heading, across, vertical, m, (records, 3).
        angle: largest of roll, pitch, and departure from the heading, rad, (records,).
        rate: largest angular velocity, rad/s, (records,).
        input: largest input of a thruster, (records,).
        depth: coordinate `down`, m, (records,).
        abort: code of what ended the script, 0 for nothing.
        dive: as an identification sees it.
    """

    time: np.ndarray
    away: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    input: np.ndarray
    depth: np.ndarray
    abort: int
    dive: SimulatedDive

    def use_of(self, limits: ExperimentLimits) -> np.ndarray:
        """How much of the limits is used at each record: 1 is all of one of them, 0 before the script, (records,)."""
        shares = [
            np.abs(self.away / (np.array(limits.room) / 2)).max(axis=1),
            self.angle / limits.angle,
            self.rate / limits.rate,
            self.input / limits.input,
        ]
        outside = (self.depth < limits.depth[0]) | (self.depth > limits.depth[1])
        return np.where(self.time < LEAD, 0.0, np.where(outside, np.inf, np.max(shares, axis=0)))


def rehearse(built: Built, station: list[float], step: float) -> Rehearsal:
    """Simulate the scenario of an experiment.

    Args:
        built: scenario of the experiment.
        station: place that it keeps.
        step: of the grid of the identification, s.
    """
    run = run_scenario(built).series
    position, velocity = run["position"].values, run["velocity"].values
    cosine, sine = np.cos(station[5]), np.sin(station[5])
    north, east, down = (position[:, :3] - station[:3]).T
    return Rehearsal(
        time=run["time"].values,
        away=np.stack([cosine * north + sine * east, cosine * east - sine * north, down], axis=1),
        angle=np.abs(np.angle(np.exp(1j * (position[:, 3:] - station[3:])))).max(axis=1),
        rate=np.abs(velocity[:, 3:]).max(axis=1),
        input=np.abs(run["input"].values).max(axis=1),
        depth=position[:, 2],
        abort=int(run["experiment_abort"].values.max()),
        dive=dive_of_run(run, step),
    )


def with_vehicle(built: Built, model: IdentificationModel, z: np.ndarray) -> Built:
    """The same scenario around the vehicle of other numbers; the law keeps its model.

    Args:
        built: scenario with a vehicle.
        model: of the same vehicle.
        z: numbers of the parameters and nuisances; of these only the parameters matter.
    """
    candidate = _candidate(model, jnp.asarray(z))
    actuation = candidate.vehicle.actuation
    assert isinstance(actuation, ThrusterActuation)  # the model drives thrusters
    replaced: Any = lambda loop: (loop.plant.body, loop.plant.thruster)
    loop = eqx.tree_at(replaced, built.closed_loop, (candidate.vehicle.body, actuation.thruster))
    assert isinstance(loop.plant, HybridVehicle)
    return built._replace(closed_loop=loop)


@eqx.filter_jit
def _candidate(model: IdentificationModel, z) -> CandidateVehicle:
    return model.candidate(z)
