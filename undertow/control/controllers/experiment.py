"""An experiment for identification: a law that keeps the place, and forces that are added to what it commands.

The inputs that result are recorded, and drive the model of the identification. So output error stays consistent
although a loop was closed, as long as the noise of the sensors is white: what the law makes of it comes a step later.
Noise that lasts, such as that of a navigation filter, correlates with the inputs, the less the weaker the law is.
"""

import enum
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from undertow.control.controllers.elapsed_time import EARLY, ElapsedTime, time_at_begin
from undertow.core import checks
from undertow.core.contracts import AbstractController, Measurement, Model, Target
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.param import Param, param
from undertow.core.signals import Signal


class Abort(enum.IntEnum):
    """Why the excitation ended early."""

    NONE = 0
    DISTANCE = 1
    DEPTH = 2
    RATE = 3
    ANGLE = 4
    INPUT = 5


class ExperimentState(NamedTuple):
    """State z: that of the law, the time, and why the excitation ended."""

    law: PyTree
    elapsed: ElapsedTime
    abort: Float[Array, ""]  # code of `Abort`


class AbortLimits(eqx.Module):
    """What ends the excitation; the law then only keeps the place.

    Raises:
        BadInput: a limit is not positive.
    """

    room: Float[Param, "3"] = param("m", "size of the room around the target: along its heading, across, vertical")
    least_depth: Float[Param, ""] = param("m", "smallest coordinate `down`")
    greatest_depth: Float[Param, ""] = param("m", "largest coordinate `down`")
    rate: Float[Param, ""] = param("rad/s", "largest angular velocity")
    angle: Float[Param, ""] = param("rad", "largest roll, pitch, and departure from the heading of the target")
    input: Float[Param, ""] = param("V or N", "largest input of a thruster")

    def __check_init__(self):
        for name in ("room", "rate", "angle", "input"):
            checks.positive(name, getattr(self, name), finite=False)

    def exceeded(self, y: Measurement, r: Target, u: Array) -> Float[Array, ""]:
        """Code of the first limit that is exceeded; 0 for none. A reading that is not finite exceeds none."""
        c, s = jnp.cos(r.position[5]), jnp.sin(r.position[5])
        away = y.position[:3] - r.position[:3]
        along = jnp.stack([c * away[0] + s * away[1], c * away[1] - s * away[0], away[2]])
        turning = y.velocity[3:6] if y.body is None else y.body.nu[3:]
        depth, heading = y.position[2], r.position[5] - y.position[5]
        angles = jnp.stack([y.position[3], y.position[4], jnp.arctan2(jnp.sin(heading), jnp.cos(heading))])
        exceeded = jnp.stack(
            [
                jnp.asarray(False),
                (jnp.abs(along) > self.room / 2).any(),
                (depth < self.least_depth) | (depth > self.greatest_depth),
                (jnp.abs(turning) > self.rate).any(),
                (jnp.abs(angles) > self.angle).any(),
                (jnp.abs(u) > self.input).any(),
            ]
        )
        codes = jnp.arange(len(Abort), dtype=float)
        first = jnp.where(exceeded, codes, float(len(Abort))).min()
        return jnp.where(first < len(Abort), first, 0.0)


class Experiment(AbstractController):
    """A law whose target accelerates as forces of a script would accelerate the nominal vehicle.

    Each row of the script is held until the next. Before the first row, from the last one on, and after an abort
    nothing is added. Limits end the script while it runs: before, the vehicle may still come. A restart of the law does
    not begin the script again.

    Raises:
        BadInput: rows that cannot be used, or a model that is not of a vehicle.
    """

    law: AbstractController
    limits: AbortLimits
    samples: Float[Param, "rows columns"] = param("s, then N and N m", "rows (t, X, Y, Z, K, M, N)")
    early: Float[Param, ""] = param("s", "time by which a row counts early, computed from all rows")
    inverse_mass_matrix: Float[Param, "6 6"] = param("1/kg, ...", "of the nominal vehicle, added mass included")

    def __init__(self, law: AbstractController, limits: AbortLimits, samples, inverse_mass_matrix):
        rows = np.asarray(samples, dtype=float)
        checks.rows_over_time("samples", rows, "t, X, Y, Z, K, M, N", width=7)
        self.law, self.limits, self.inverse_mass_matrix = law, limits, inverse_mass_matrix
        self.samples, self.early = jnp.asarray(rows), jnp.asarray(EARLY * np.diff(rows[:, 0]).min())

    @property
    def model(self) -> Model:  # pyright: ignore[reportIncompatibleVariableOverride]
        """That of the law: a supervisor that replaces it replaces the law's."""
        return self.law.model

    def init(self, y: Measurement, r: Target) -> ExperimentState:
        return ExperimentState(self.law.init(y, r), time_at_begin(y.position), jnp.zeros_like(y.position[0]))

    def command(self, z: ExperimentState, y: Measurement, r: Target):
        u, signals = self.law.command(z.law, y, self._accelerated(z, y, r))
        return u, signals | {"excitation": self._wrench(z), "experiment_abort": z.abort}

    def advance(self, z: ExperimentState, y: Measurement, r: Target, u_applied, dt) -> ExperimentState:
        law = self.law.advance(z.law, y, self._accelerated(z, y, r), u_applied, dt)
        abort = jnp.where(z.abort > 0, z.abort, self.limits.exceeded(y, r, u_applied))
        now, times = z.elapsed.time + self.early, self.samples[:, 0]
        runs = (now >= times[0]) & (now < times[-1])
        return ExperimentState(law, z.elapsed.after(dt), jnp.where(runs, abort, z.abort))

    def signals(self):
        return self.law.signals() | {
            "excitation": Signal(("axis",), "N, N m", "force and moment added by the experiment, body axes"),
            "experiment_abort": Signal(
                (), "1", "0 none; excitation ended by 1 distance, 2 depth, 3 rate, 4 angle, 5 input"
            ),
        }

    def known_acceleration(self, z: ExperimentState, y: Measurement, u_applied):
        return self.law.known_acceleration(z.law, y, u_applied)

    @property
    def takes_raw_readings(self) -> bool:
        return self.law.takes_raw_readings

    def knowledge(self, z: ExperimentState) -> PyTree:
        return z._replace(law=self.law.knowledge(z.law))

    def restarted(self, knowledge: Any, y: Measurement, r: Target) -> ExperimentState:
        return knowledge._replace(law=self.law.restarted(knowledge.law, y, r))

    def _wrench(self, z: ExperimentState) -> Float[Array, "6"]:
        times = self.samples[:, 0]
        count = jnp.searchsorted(times, z.elapsed.time + self.early, side="right")
        row = self.samples[jnp.clip(count - 1, 0, times.shape[0] - 1), 1:]
        acts = (count > 0) & (count < times.shape[0]) & (z.abort == 0)
        return jnp.where(acts, row, 0.0)

    def _accelerated(self, z: ExperimentState, y: Measurement, r: Target) -> Target:
        added = matvec(self.inverse_mass_matrix, self._wrench(z))
        return r._replace(acceleration=r.acceleration + self.model.coordinates.output_velocity(y, added))


def experiment(
    model: Model,
    samples,
    law,
    room=(1e3, 1e3, 1e3),
    min_depth: float = -1e3,
    max_depth: float = 1e4,
    max_rate: float = 1e3,
    max_angle: float = 1e3,
    max_input: float = 1e3,
) -> Experiment:
    """An experiment for identification: forces of a script added to a law that keeps the place, with abort limits.

    `undertow identify-design` writes one. In a scenario, `file: experiment.csv` gives the script (header t,d1,...,d6).

    Args:
        model: nominal model, from `plant.model()`.
        samples: rows of time (s) and force and moment in body axes (N, N m), each held until the next; the last row
            ends the script.
        law: the law that keeps the place, by name with its options, such as a PID of low frequency without filter of
            the reference (`reference_frequency: 0`), which would take the added accelerations for jumps.
        room: size of the room around the target: along its heading, across and vertical, m.
        min_depth: smallest coordinate `down`, m.
        max_depth: largest coordinate `down`, m.
        max_rate: largest angular velocity about an axis of the body, rad/s.
        max_angle: largest roll, pitch, and departure from the heading of the target, rad.
        max_input: largest input of a thruster, in its unit.

    Raises:
        BadInput: a value is out of its range, or the plant is not one vehicle with a law in body axes.
    """
    laws = tuple(law) if isinstance(law, tuple | list) else (law,)
    if len(laws) != 1 or not isinstance(laws[0], AbstractController):
        raise BadInput("law", "be one controller of one vehicle", f"{len(laws)} laws")
    body = getattr(laws[0].model.dynamics, "body", None)
    if body is None or not laws[0].model.coordinates.axes:
        raise BadInput("law", "be a controller in the body axes of a vehicle, such as pid", type(laws[0]).__name__)
    depths = (jnp.asarray(min_depth, dtype=float), jnp.asarray(max_depth, dtype=float))
    numbers = (jnp.asarray(value, dtype=float) for value in (max_rate, max_angle, max_input))
    limits = AbortLimits(jnp.asarray(room, dtype=float), *depths, *numbers)
    return Experiment(laws[0], limits, samples, body.inverse_mass_matrix)
