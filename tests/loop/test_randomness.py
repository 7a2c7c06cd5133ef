"""Every part has a key of its own, and noise is new at every sample however long a run is or however short its steps."""

import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers.pid import pid
from undertow.control.navigation.observer import observer
from undertow.control.navigation.white_noise import white_noise
from undertow.control.references.setpoint import setpoint
from undertow.core import catalogue, runtime
from undertow.core.contracts import AbstractDisturbance, AbstractNavigation, Measurement
from undertow.core.measurement import measurement_of_outputs
from undertow.core.numerics.random_keys import keys_for, numbered
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.physics.disturbances.none import none
from undertow.physics.plants.double_integrator import double_integrator
from undertow.physics.sensors import compass, depth, dvl, imu, position_fix, propeller_speed
from undertow.physics.sensors.sensor import AbstractSensor
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

DEVIATION = 0.1


class Keyed(AbstractDisturbance):
    """No load; its path is its key."""

    def realize(self, key):
        return key

    def at(self, path, t, place, calm):
        return calm

    def jumps(self, duration):
        return ()


numbered_all = jax.jit(jax.vmap(numbered, (None, 0)))


@eqx.filter_jit
def realized(loop, key):
    realization = loop.realize(key)
    return realization.disturbance_realization, realization.navigation_realization


@pytest.mark.parametrize("seed", [0, 1, 2**32 - 1])
def test_no_two_parts_share_a_key(seed):
    """Disturbances by nine, three of them in a group of their own, all sensors, and each of their samples."""
    disturbance = SumOfDisturbances((*(Keyed() for _ in range(6)), SumOfDisturbances((Keyed(), Keyed(), Keyed()))))
    sensors = [imu(), dvl(), depth(), position_fix(), compass(), propeller_speed()]
    plant = double_integrator()
    loop = ClosedLoop(plant, pid(plant.model()), setpoint([0.0]), disturbance, observer(sensors))
    of_disturbances, of_sensors = realized(loop, jax.random.PRNGKey(seed))
    keys = [*jax.tree.leaves(of_disturbances), *np.asarray(of_sensors)]
    samples = np.concatenate([numbered_all(key, np.array([-1, 0, 1, 2, 3, 4, 5])) for key in np.asarray(of_sensors)])
    assert len(keys) == 9 + len(sensors) and all(isinstance(one, AbstractSensor) for one in sensors)
    assert len({tuple(np.asarray(key).tolist()) for key in (*keys, *samples)}) == len(keys) + len(samples)


def test_numbers_that_differ_in_any_bit_have_other_keys():
    """In 64 bits also those 2^32 apart, which are one number to `jax.random.fold_in`."""
    key = jax.random.PRNGKey(0)
    numbers = [-1, 0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**32 + 1, 2**33, 2**53, 2**62]
    keys = set(map(tuple, np.asarray(numbered_all(key, np.array(numbers))).tolist()))
    assert len(keys) == len(numbers)
    np.testing.assert_array_equal(jax.random.fold_in(key, np.int64(2**32)), jax.random.fold_in(key, 0), "the reason")


def noise_of_a_run(duration, dt, simulate=sampled.simulate):
    """Errors of the measured position at every sample."""
    plant = double_integrator()
    law = pid(plant.model(), sampling_time=dt, frequency=0.05 / dt)
    loop = ClosedLoop(plant, law, setpoint([0.0]), none(), white_noise(DEVIATION, 0.0))
    samples = simulate(loop, duration=duration, dt=dt, record_every=1).signals
    return np.asarray(samples["measured_position"] - samples["position"])[:-1, 0]


SCALES = [(1e7, 2e3), (6e3, 1.0), (5e-4, 1e-7)]  # duration and step, s


@pytest.mark.parametrize(
    ("simulate", "duration", "dt"),
    [
        (simd_batch.simulate, *SCALES[0]),
        *(pytest.param(simd_batch.simulate, *scale, marks=pytest.mark.full) for scale in SCALES[1:]),
        *(pytest.param(sampled.simulate, *scale, marks=pytest.mark.slow) for scale in SCALES),
    ],
)
def test_noise_is_white_at_any_time_scale(duration, dt, simulate):
    """Beyond 2^32 microseconds, to four months, and below a microsecond."""
    errors = noise_of_a_run(duration, dt, simulate)
    n = len(errors)
    assert n == round(duration / dt) and len(set(errors)) == n, "no sample shares its draw"
    for part in (errors[: n // 2], errors[n // 2 :], errors[-500:]):
        m = len(part)
        assert part.std() == pytest.approx(DEVIATION, rel=4 / np.sqrt(2 * m))
        assert abs(part.mean()) < 4 * DEVIATION / np.sqrt(m)
        assert abs((part[1:] * part[:-1]).mean()) < 4 * DEVIATION**2 / np.sqrt(m)


@pytest.mark.parametrize(
    "precision", [pytest.param("float64", marks=pytest.mark.full), pytest.param("float32", marks=pytest.mark.slow)]
)
def test_instruments_are_heard_and_noisy_at_any_time(precision):
    """After 1e7 s at 10 s, and in double precision at a tenth of a microsecond."""
    with runtime.in_precision(precision):
        times = [(0.0, 10.0), (1e7, 10.0)] + [(0.0, 1e-7), (1e5, 1e-7)] * (precision == "float64")
        for start, period in times:
            sensor = observer([imu(period=period), compass(period=period, noise=DEVIATION)], compass_blend=1.0)
            truth = measurement_of_outputs(jnp.zeros(6), jnp.zeros(6))
            path = sensor.realize(jax.random.PRNGKey(1))

            def step(state, k, sensor=sensor, path=path, truth=truth, start=start, period=period):
                told, state = sensor.measure(path, state, start + period * k, truth)
                return state, told.position[5]

            first = sensor.init(path, truth)
            yaw = np.asarray(jax.lax.scan(step, first, jnp.arange(400, dtype=float))[1])
            assert yaw[1:].std() == pytest.approx(DEVIATION, rel=4 / np.sqrt(2 * 400)), (start, period)
            assert len(set(yaw[1:])) > 390


def test_single_precision_noise_outlives_its_clock():
    """Beyond 2^24 steps two instants are one in float32, but their noise is not: samples are counted."""
    with runtime.in_precision("float32"):
        sensor: AbstractNavigation = white_noise(DEVIATION, 0.0)
        path, zero = sensor.realize(jax.random.PRNGKey(0)), np.zeros(1, dtype=np.float32)
        measured = lambda state: sensor.measure(path, state, jnp.asarray(1e5), Measurement(zero, zero))[0]
        positions = jax.jit(jax.vmap(measured))(2**24 + np.arange(9)).position
        assert len(set(np.asarray(positions).ravel().tolist())) == 9


REQUIRED = {"sensors": lambda: [imu(), dvl(), depth(), position_fix(), compass()]}
DRAWING = ("uniform", "normal", "permutation", "bernoulli", "exponential", "choice", "randint")
BRANCHING = ("split", "fold_in")


def every(kind, base):
    """All parts of a kind that can be made with their defaults."""
    for part in catalogue.names(kind).values():
        needed = [p.name for p in inspect.signature(part).parameters.values() if p.default is inspect.Parameter.empty]
        if set(needed) <= {"sensors"}:
            made = part(**{name: REQUIRED[name]() for name in needed})
            if isinstance(made, base):
                yield made


@pytest.fixture
def used(monkeypatch):
    """Keys that are drawn from and keys that others are made of, as they are used."""
    found = {"drawing": [], "branching": []}

    def watched(name, kind):
        real = getattr(jax.random, name)

        def call(key, *rest, **options):
            note = lambda key: found[kind].append(tuple(np.asarray(key).tolist()))
            if isinstance(key, jax.core.Tracer):
                jax.debug.callback(note, key)
            else:
                note(key)
            return real(key, *rest, **options)

        monkeypatch.setattr(jax.random, name, call)

    for name in DRAWING:
        watched(name, "drawing")
    for name in BRANCHING:
        watched(name, "branching")
    return found


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 2**32 - 1])
def test_no_key_is_used_twice(used, seed):
    """Every random part of the catalogue in one loop: each draws from keys of its own, and from no key twice."""
    plant = double_integrator()
    law = pid(plant.model())
    disturbance = SumOfDisturbances(tuple(every("disturbances", AbstractDisturbance)))
    for several in every("navigation", AbstractNavigation):
        used["drawing"].clear()
        used["branching"].clear()
        loop = ClosedLoop(plant, law, setpoint([0.0]), disturbance, several)
        realization = loop.realize(jax.random.PRNGKey(seed))
        truth = measurement_of_outputs(jnp.zeros(6), jnp.zeros(6))
        state = several.init(realization.navigation_realization, truth)
        for k in range(3):
            _, state = several.measure(
                realization.navigation_realization, state, jnp.asarray(1.5 * k), truth
            )  # a new reading of each
        jax.effects_barrier()
        drawn = used["drawing"]
        assert len(drawn) > 6 and len(set(drawn)) == len(drawn), "a key is drawn from once"
        assert not set(drawn) & set(used["branching"]), "and no other key is made of it"


def test_keys_by_name():
    """All different, found by name, and a name that comes in later leaves the others as they were."""
    key = jax.random.PRNGKey(4)
    few, more = keys_for(key, "disturbance", "navigation"), keys_for(key, "disturbance", "navigation", "faults")
    assert list(more) == ["disturbance", "navigation", "faults"]
    assert len({tuple(np.asarray(one).tolist()) for one in (key, *more.values())}) == 4
    for name, own in few.items():
        np.testing.assert_array_equal(own, more[name])
    with pytest.raises(ValueError, match="must be different, but are: waves, waves"):
        keys_for(key, "waves", "waves")
