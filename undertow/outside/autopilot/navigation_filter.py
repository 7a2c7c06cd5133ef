"""One compiled navigation filter, stepped by somebody else's clock and fed with the readings of real sensors."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from undertow.control.navigation.from_sensors import SensorNavigation
from undertow.core import checks, runtime
from undertow.core.checks import numbers
from undertow.core.errors import BadInput, did_you_mean
from undertow.logs.frames import attitudes_of_quaternions, quaternions
from undertow.outside.autopilot.clock import StepClock
from undertow.outside.autopilot.filter_functions import EstimatedMotion, FilterFunctions
from undertow.outside.autopilot.saved_state import packed, restore_arrays
from undertow.outside.autopilot.step_log import StepLog, filter_signals
from undertow.scenario.build import build
from undertow.scenario.link_scenario import at_sampling_time, text_of
from undertow.simulation.loop.stepped import Uncopied, compile_step, copy_into


class NavigationFilter(Uncopied):
    """The filter of a scenario's `navigation`, called at every sampling time by whoever owns the clock::

        navigation = ut.NavigationFilter("bluerov2_heavy.yaml")
        navigation.start(position, velocity, attitude)
        while True:
            motion = navigation.step({"imu": imu, "dvl": velocity}, ages={"dvl": 0.08})
            volts = autopilot.step(*motion)

    Each step takes the readings that have arrived since the last one, the newest of each sensor; sensors without one
    are left out. Entries that are not finite were not measured. The same readings give the same bits as in a
    simulation.

    Args:
        scenario: a .yaml file or an earlier run.nc, or the same as a mapping.
        sampling_time: s; None for that of the scenario.
        log: .mcap file for the estimate and the signals of every step, as of `Autopilot`; None for none.
        allow_code: whether the Python code that an earlier run.nc names may run; that of a .yaml file may.

    Attributes:
        sampling_time: s.
        sensors: numbers of a reading, by name of the sensor: `imu`, `dvl`, ...; a second DVL is `dvl_2`.
        backend: `simd` or `xla`.

    Raises:
        BadInput: something given cannot be used, or the scenario's navigation is not a filter of readings.
    """

    _instead = "Make another one, and `restore` there what `save` gives"

    def __init__(
        self,
        scenario: str | Path | Mapping[str, Any],
        *,
        sampling_time: float | None = None,
        log: str | Path | None = None,
        allow_code: bool = False,
    ):
        if sampling_time is not None:
            checks.positive("sampling_time", sampling_time, "s")
        built = build(at_sampling_time(text_of(scenario, allow_code), sampling_time))
        navigation = built.closed_loop.navigation
        if not isinstance(navigation, SensorNavigation):
            raise BadInput("navigation", "be one of sensors: `kalman` or `observer`", built.scenario.navigation.kind)
        self.sampling_time = built.scenario.loop.dt
        self._clock = StepClock(self.sampling_time)
        self._started = np.zeros((), dtype=bool)
        with runtime.on_processor(), runtime.in_precision(built.scenario.precision):
            self._compile(FilterFunctions(navigation.filter, built.closed_loop.plant))
        declared = self.declared_signals()
        values = self._go_on.outputs.signals
        make_log = lambda path: StepLog(path, filter_signals(declared, values), self.sampling_time, self)
        self._log = None if log is None else make_log(log)

    def close_log(self) -> None:
        """Finish the log, if there is one; later steps are not written."""
        if self._log is not None:
            self._log.close()

    def _compile(self, functions: FilterFunctions) -> None:
        self.sensors = functions.sensors
        self._delays = functions.delays
        self._signals = functions.filter.signals()
        self._begin = compile_step(
            lambda navigation, _, pose: ((), functions.first(navigation, pose)), functions.filter, (), functions.pose
        )
        state = jax.tree.map(jnp.asarray, self._begin.outputs)
        inputs = (jnp.zeros(()), functions.nothing)
        self._go_on = compile_step(
            lambda navigation, state, inputs: functions.following(navigation, state, *inputs),
            functions.filter,
            state,
            inputs,
        )
        self.backend = self._go_on.backend

    def start(
        self, position: Any, velocity: Any, attitude: Any, readings: Mapping[str, Any] | None = None
    ) -> EstimatedMotion:
        """Begin with a motion that is known to the standard deviations of the filter.

        Args:
            position: north, east, down, m.
            velocity: u, v, w, p, q, r in body axes, m/s and rad/s.
            attitude: quaternion w, x, y, z (body -> world), or roll, pitch, yaw, rad.
            readings: as for `step`, of now.

        Raises:
            BadInput: a shape is wrong, a number is not finite, or a sensor is unknown.
        """
        as_angles = np.shape(attitude) == (3,)
        motion = EstimatedMotion(
            numbers("position", position, (3,)),
            numbers("velocity", velocity, (6,)),
            numbers("attitude", attitude, (3,) if as_angles else (4,)),
        )
        for name, value in zip(EstimatedMotion._fields, motion, strict=True):
            checks.finite(name, value)
        length = 1.0 if as_angles else np.linalg.norm(motion.attitude)
        if not length > 0:
            raise BadInput("attitude", "be a quaternion of some length", "zero")
        angles = quaternions(motion.attitude) if as_angles else motion.attitude / length
        received = self._received(readings or {}, {})
        copy_into(self._begin.inputs, motion._replace(attitude=angles))
        self._begin()
        copy_into(self._go_on.state, self._begin.outputs)
        self._clock.begin()
        self._started[...] = True
        return self._stepped(0.0, received)

    def step(
        self, readings: Mapping[str, Any], ages: Mapping[str, float] | None = None, dt: float | None = None
    ) -> EstimatedMotion:
        """One step.

        Args:
            readings: numbers of each sensor that has a new reading, by its name, in the units of the sensor.
            ages: s since they were taken, by name; without an entry the delay that the scenario states.
            dt: time since the last step, s; None for the sampling time. Late steps follow the rule of `Autopilot`.

        Raises:
            BadInput: a sensor is unknown, a shape is wrong, an age is negative, or `start` was not called.
        """
        if not self._started:
            raise BadInput("start", "be called before `step`", "not")
        received = self._received(readings, ages or {})
        before = self._clock.time
        elapsed = self._clock.passed(dt)
        on_time = elapsed == self.sampling_time  # then rounded as the times of a simulation are
        return self._stepped(self._clock.time - before if on_time else elapsed, received)

    def signals(self) -> dict[str, np.ndarray]:
        """Values of the signals of the last step, such as the standard deviation of each output."""
        return {name: value.copy() for name, value in self._go_on.outputs.signals.items()}

    def declared_signals(self) -> dict[str, Any]:
        """Unit and meaning of the signals, by name."""
        return dict(self._signals)

    @property
    def propellers(self) -> tuple[np.ndarray, ...]:
        """Estimated speeds of the propellers, rad/s, and accelerations where the scenario has them; () without."""
        return tuple(leaf.copy() for leaf in jax.tree.leaves(self._go_on.outputs.actuator))

    @property
    def counts(self) -> dict[str, int]:
        """Steps after the first one, and those of them that were late, missed or repeated."""
        return self._clock.counts

    def save(self) -> bytes:
        """The state; a filter that is made alike goes on from it with the same bits."""
        if not self._started:
            raise BadInput("start", "be called before `save`", "not")
        return packed(self._identity(), self._state_arrays())

    def restore(self, state: bytes) -> None:
        """Go on from a state that `save` gave.

        Raises:
            BadInput: it is damaged, or of another filter; everything stays as it was.
        """
        restore_arrays(self._state_arrays(), state, self._identity())

    def _state_arrays(self) -> list[np.ndarray]:
        steps = jax.tree.leaves((self._go_on.state, self._go_on.outputs))
        return [*steps, self._started, self._clock.numbers]

    def _identity(self) -> bytes:
        form = jax.tree.structure((self._go_on.state, self._go_on.outputs)), self.sensors, self.sampling_time
        return repr(form).encode() + b"".join(number.tobytes() for number in jax.tree.leaves(self._go_on.numbers))

    def _received(self, readings: Mapping[str, Any], ages: Mapping[str, float]) -> list[tuple[Any, bool, float]]:
        for argument, by_sensor in (("readings", readings), ("ages", ages)):
            if not isinstance(by_sensor, Mapping):
                raise BadInput(argument, "be a mapping from the name of a sensor", repr(by_sensor))
            for name in by_sensor:
                if name not in self.sensors:
                    raise BadInput(
                        argument, "be of sensors of the scenario", repr(name), hint=did_you_mean(name, self.sensors)
                    )
        received = []
        for (name, size), delay in zip(self.sensors.items(), self._delays, strict=True):
            new = name in readings and readings[name] is not None
            reading = readings[name] if new else np.zeros(size)
            value = numbers(
                f"readings[{name!r}]", [reading] if size == 1 and np.ndim(reading) == 0 else reading, (size,)
            )
            age = ages.get(name, delay)
            checks.not_negative(f"ages[{name!r}]", age)
            received.append((value, new, age))
        return received

    def _stepped(self, elapsed: float, received: list[tuple[Any, bool, float]]) -> EstimatedMotion:
        copy_into(self._go_on.inputs, (elapsed, received))
        self._go_on()
        motion = EstimatedMotion(*(part.copy() for part in self._go_on.outputs.motion))
        if self._log is not None:
            attitude = attitudes_of_quaternions(motion.attitude[None], "NED", "FRD")[0]
            velocities = {"body_velocity": motion.velocity[:3], "angular_velocity": motion.velocity[3:]}
            estimate = {"position": motion.position, "attitude": attitude} | velocities
            self._log.append(self._clock.time, estimate | self._go_on.outputs.signals)
        return motion
