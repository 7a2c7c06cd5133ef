"""The rule that chooses bandwidths: its margins and its predicted cost against exact matrices of the sampled loop."""

import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from recorded import is_as_recorded
from scipy.linalg import expm, solve_discrete_lyapunov

from undertow.control.controllers import bandwidths
from undertow.control.controllers.bandwidths import MARGINS, Axis, pid_frequency, robust_bandwidths
from undertow.control.controllers.options import LOAD_RATE, DesignConditions
from undertow.control.controllers.pid import pid
from undertow.control.controllers.presets.robust import robust
from undertow.core.errors import BadInput
from undertow.physics.plants import double_integrator, hybrid_vehicle
from undertow.physics.thrusters import first_order, t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.run import simulate_scenario

AXES = [
    Axis(dt, lag, max(0.35 / dt, 1 / lag if lag else 0.0), delay, noise, 1.0, authority)
    for dt in (1e-3, 0.01, 0.05)
    for lag in (0.0, 0.03, 0.1, 0.3)
    for delay, noise, authority in ((0.0, 0.0, 5.0), (0.1, 0.0, 5.0), (0.0, 0.01, 5.0), (0.0, 0.0, np.inf))
]

chosen_for = functools.cache(robust_bandwidths)


def plant_matrices(axis, lag_factor, added, wait=0.0):
    """x_ddot = f + d behind the actuator, over one sampling time with load held: A, B of u, B of d, B of the older u.

    The newer input is held from `wait` (s) on, the older one before.
    """
    lags = [lag for lag in (lag_factor * (axis.lag or 0.0), added) if lag > 0]
    n = 2 + len(lags)
    a, b = np.zeros((n, n)), np.zeros((n, 2))
    a[0, 1] = b[1, 1] = 1.0
    for i, lag in enumerate(lags):
        a[1 + i, 2 + i] += 1.0 if i == 0 else 1 / lags[i - 1]
        a[2 + i, 2 + i] = -1 / lag
    b[-1 if lags else 1, 0] = 1 / lags[-1] if lags else 1.0
    over = lambda time: expm(np.block([[a, b], [np.zeros((2, n + 2))]]) * time)[:n]
    step, newer = over(axis.sampling_time), over(axis.sampling_time - wait)[:, n]
    return step[:, :n], newer, step[:, n + 1], step[:, n] - newer


def whole_and_rest(axis, delay):
    """A delay (s) in sampling times, and what is left over, s."""
    steps = int(delay / axis.sampling_time + 1e-9)
    return steps, max(0.0, delay - steps * axis.sampling_time)


def loop(axis, chosen, lag_factor=1.0, added=0.0, delay=0.0):
    """A, B of load and velocity noise, and u = C s + D n, of the whole sampled loop with preset `robust`.

    Added lag and delay in s.
    """
    steps, rest = whole_and_rest(axis, delay + axis.delay)
    step, push, load, older = plant_matrices(axis, lag_factor, added, rest)
    n, dt, late = len(step), axis.sampling_time, steps + (rest > 1e-9)
    rates, estimate, force = n, n + 1, n + 2
    size = n + 3 + late
    unit = np.eye(size)
    decay = np.exp(-chosen.bandwidth * dt)
    asked = -(chosen.tracking**2) * unit[0] - 2 * chosen.tracking * unit[1] - unit[estimate]
    asked_noise = -2 * chosen.tracking
    lead = axis.lag * chosen.actuators if axis.lag else 1.0
    u, u_noise = lead * asked + (1 - lead) * unit[force], lead * asked_noise
    given, given_noise = (unit[force], 0.0) if axis.lag else (u, u_noise)
    eps = unit[rates] - unit[1]
    matrix, entry = np.zeros((size, size)), np.zeros((size, 2))
    matrix[:n, :n], entry[:n, 0] = step, load
    if late:
        matrix[:n, n + 3 + late - 1] = older if rest > 1e-9 else push
        if late > steps > 0:
            matrix[:n, n + 3 + steps - 1] = push
        elif late > steps:
            matrix[:n] += np.outer(push, u)
            entry[:n, 1] += push * u_noise
        matrix[n + 3], entry[n + 3, 1] = u, u_noise
        for i in range(1, late):
            matrix[n + 3 + i, n + 3 + i - 1] = 1.0
    else:
        matrix[:n] += np.outer(push, u)
        entry[:n, 1] += push * u_noise
    of_rates = 2 - 2 * decay
    matrix[rates] = unit[rates] + dt * (given + unit[estimate]) - of_rates * eps
    entry[rates, 1] = dt * given_noise + of_rates
    matrix[estimate] = unit[estimate] - (1 - decay) ** 2 / dt * eps
    entry[estimate, 1] = (1 - decay) ** 2 / dt
    if axis.lag:
        kept = np.exp(-dt / axis.lag)
        matrix[force], entry[force, 1] = kept * unit[force] + (1 - kept) * u, (1 - kept) * u_noise
    return matrix, entry, u, u_noise


@pytest.mark.parametrize("axis", [axis for axis in AXES if axis.delay < 100 * axis.sampling_time], ids=str)
def test_no_margin_is_broken(axis):
    """Spectral radius of the sampled loop with every lag, added lag and delay that the rule promises to survive."""
    chosen = chosen_for(axis)
    for factor, *beside, _ in MARGINS:
        added, delay = (share * axis.unknown_delay for share in beside)
        matrix, *_ = loop(axis, chosen, factor, added, delay)
        assert np.abs(np.linalg.eigvals(matrix)).max() < 1, (factor, added, delay)


def test_the_rule_chooses_what_it_chose_when_it_was_recorded():
    is_as_recorded("bandwidths of the robust law", [tuple(chosen_for(axis)) for axis in AXES])


def test_the_margins_are_those_that_are_stated():
    """Twice the lag with three quarters of the unknown delay, three times and a third of the lag; the whole delay.

    That is four sampling times, but never more than 20 ms: a slow loop is not one of slow sensors.
    """
    asked = {(factor, delay) for factor, _, delay, _ in MARGINS}
    assert {(2.0, 0.75), (3.0, 0.0), (1 / 3, 0.0), (1.0, 1.0)} <= asked
    unknown = [AXES[0]._replace(sampling_time=dt).unknown_delay for dt in (1e-3, 5e-3, 0.01, 0.05)]
    np.testing.assert_allclose(unknown, [4e-3, 0.02, 0.02, 0.02], rtol=1e-12)


# What noise adds to the error counts where loads hardly change and chattering costs nothing.
NOISY = AXES[4]._replace(load_rate=1e-3, authority=np.inf)


@pytest.mark.parametrize("axis", [AXES[0], AXES[4], AXES[6], AXES[20], AXES[24], NOISY], ids=str)
def test_the_predicted_cost_is_that_of_the_lyapunov_equation(axis):
    """Frequency integrals of the rule against stationary covariances; the swell by the loop's answer at 1 rad/s."""
    axis, chosen = axis._replace(velocity_noise=0.01), robust_bandwidths(axis)
    matrix, entry, u, u_noise = loop(axis, chosen)
    dt, size = axis.sampling_time, len(matrix)
    rest = np.linalg.solve(np.eye(size) - matrix, entry[:, 0])  # per constant load: a walk is a sum of small steps
    walk = np.sqrt(dt * solve_discrete_lyapunov(matrix, np.outer(rest, rest))[0, 0])
    swell = abs(np.linalg.solve(np.exp(1j * dt) * np.eye(size) - matrix, entry[:, 0])[0]) * np.sqrt(2 * np.pi)
    noisy = solve_discrete_lyapunov(matrix, np.outer(entry[:, 1], entry[:, 1]))
    change = u @ matrix - u
    variance = change @ noisy @ change + (u @ entry[:, 1] - u_noise) ** 2 + u_noise**2
    error = np.sqrt(axis.load_rate**2 * (walk**2 + swell**2) + axis.velocity_noise**2 * noisy[0, 0])
    step = np.sqrt(2 / np.pi * variance) * axis.velocity_noise
    expected = error / 0.05 + step / axis.authority / 0.02
    frequency = np.geomspace(1e-4, np.pi, 400) / dt
    s = 1j * frequency
    law = bandwidths._robust(axis, s, *(np.array([[rate]]) for rate in chosen))
    held = (1 - np.exp(-s * dt)) / (s * dt)
    open_loop = held * (law.of_position / s**2 + law.of_velocity / s)
    np.testing.assert_allclose(bandwidths._cost(axis, frequency, law, held, open_loop), expected, rtol=0.05)


def test_values_between_frequencies_are_linear_in_the_logarithm():
    frequency = np.geomspace(0.1, 10.0, 7)
    for point, seen in ((0.05, 0.1), (0.1, 0.1), (0.37, 0.37), (1.0, 1.0), (10.0, 10.0), (20.0, 10.0)):
        values = np.stack([np.log(frequency), 3 - 2 * np.log(frequency)])
        found = bandwidths._at(point, frequency, values)
        np.testing.assert_allclose(found, [np.log(seen), 3 - 2 * np.log(seen)], atol=1e-12)


def test_noise_and_delay_slow_a_law_and_limits_price_its_chattering():
    base = AXES[4]
    noise = [robust_bandwidths(base._replace(velocity_noise=sigma)) for sigma in (0.0, 1e-3, 1e-2, 1e-1)]
    gain = [2 * one.tracking * max(1.0, base.lag * one.actuators) for one in noise]  # of noise on the input
    assert all(later <= earlier for earlier, later in itertools.pairwise(gain)) and gain[-1] < gain[0] / 4
    weak = robust_bandwidths(base._replace(velocity_noise=1e-2, authority=0.5))
    assert weak.tracking * weak.actuators < noise[2].tracking * noise[2].actuators
    assert robust_bandwidths(base._replace(delay=0.1)).tracking < noise[0].tracking / 3


def test_dead_zone_without_a_lag_slows_a_law():
    axis = AXES[0]._replace(load_rate=LOAD_RATE)
    ignoring, knowing = (robust_bandwidths(axis._replace(dead_zone=zone)) for zone in (0.0, 1.2 / 16))
    assert knowing.tracking < ignoring.tracking / 5 and knowing.bandwidth < ignoring.bandwidth / 2
    assert pid_frequency(axis._replace(dead_zone=1.2 / 16)) < pid_frequency(axis) / 4
    lagged = axis._replace(lag=0.1)
    assert robust_bandwidths(lagged._replace(dead_zone=1.2 / 16)) == robust_bandwidths(lagged)


@pytest.mark.parametrize(
    "thruster",
    [
        t200(fidelity="static", supply=16.0, dead_zone=1.2),
        t200(fidelity="shaft", supply=16.0, dead_zone=1.2),
        first_order(supply=16.0, dead_zone=1.2),
    ],
)
def test_models_tell_the_dead_zone_of_their_actuators(thruster):
    model = hybrid_vehicle(bluerov2_heavy(), thruster).model().in_body_axes()
    assert float(model.actuators.dead_zone()) == pytest.approx(1.2 / 16)


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_pid_keeps_the_same_margins(lag):
    axis = Axis(0.01, lag, 35.0, 0.0, 0.0, 1.0, 5.0)
    frequency = pid_frequency(axis)
    for factor, *beside, _ in MARGINS:
        added, delay = (share * axis.unknown_delay for share in beside)
        late, rest = whole_and_rest(axis, delay)
        step, push, _, older = plant_matrices(axis, factor, added, rest)
        n, steps, late = len(step), late, late + (rest > 1e-9)
        matrix = np.zeros((n + 1 + late, n + 1 + late))
        matrix[:n, :n], matrix[n, n], matrix[n, 0] = step, 1.0, -0.01 * 0.1 * frequency**3
        u = np.zeros(n + 1 + late)
        u[[0, 1, n]] = -(frequency**2), -2 * frequency, 1.0
        if late:
            matrix[:n, -1], matrix[n + 1] = older if rest > 1e-9 else push, u
            if late > steps > 0:
                matrix[:n, n + steps] = push
            elif late > steps:
                matrix[:n] += np.outer(push, u)
            for i in range(1, late):
                matrix[n + 1 + i, n + i] = 1.0
        else:
            matrix[:n] += np.outer(push, u)
        assert np.abs(np.linalg.eigvals(matrix)).max() < 1, (factor, added, delay)


@pytest.mark.full
def test_laws_take_them():
    """Per axis where noise differs; a bandwidth that is given has its tracking beside it; PID by the same rule."""
    model = hybrid_vehicle(bluerov2_heavy(), t200()).model()
    noise = [0.5, 0.5, 0.5, 1e-3, 1e-3, 1e-3]
    law = robust(model, sampling_time=0.01, velocity_noise=noise)
    axes = bandwidths.axes_of(model.in_body_axes(), DesignConditions(0.01, noise))
    np.testing.assert_allclose(law.estimator.bandwidth, [robust_bandwidths(axis).bandwidth for axis in axes])
    np.testing.assert_allclose(law.feedback[..., 1] / 2, [robust_bandwidths(axis).tracking for axis in axes])
    assert robust_bandwidths(axes[0]).tracking < robust_bandwidths(axes[5]).tracking
    assert axes[0].lag == pytest.approx(0.1, rel=0.2) and np.isfinite(axes[0].authority)
    frequency = np.sqrt(np.asarray(pid(model, sampling_time=0.01, velocity_noise=noise).proportional))
    np.testing.assert_allclose(frequency, [pid_frequency(axis) for axis in axes])
    slow = robust(model, sampling_time=0.01, bandwidth=3.0)
    np.testing.assert_allclose(np.sqrt(slow.feedback[..., 0]), 1.5)
    assert float(slow.actuator_rate) == pytest.approx(9.0)
    lagged = hybrid_vehicle(bluerov2_heavy(), first_order(time_constant=0.2)).model()
    assert bandwidths.axes_of(lagged.in_body_axes(), DesignConditions(0.01))[0].lag == pytest.approx(0.2)
    still = bandwidths.axes_of(double_integrator(1).model(), DesignConditions(0.01))[0]
    assert still.lag == 0.0 and np.isinf(still.authority)


def test_a_law_may_be_made_inside_a_compiled_function():
    """As `tune` does: what is traced is what is tuned, the rest are numbers."""
    model = double_integrator(1, limit=3.0).model()
    made = jax.jit(lambda bandwidth: robust(model, bandwidth=bandwidth).feedback)(jnp.asarray(20.0))
    np.testing.assert_allclose(made, robust(model, bandwidth=20.0).feedback, rtol=1e-12)


@pytest.mark.parametrize("wrong", [{"delay": -0.1}, {"velocity_noise": -1.0}, {"load_rate": 0.0}, {"sampling_time": 0}])
def test_impossible_values_are_named(wrong):
    for make in (robust, pid):
        with pytest.raises(BadInput, match=next(iter(wrong))):
            make(double_integrator(1).model(), **wrong)


@pytest.mark.full
@pytest.mark.parametrize("law, variation, error", [("robust", 1.0, 0.005), ("pid", 4.0, 0.001)])
def test_thrusters_without_lag_do_not_chatter_in_still_water(law, variation, error):
    """1 N of net weight is less than the thrust at the edge of the dead zone: with gains for its sampling time alone, a
    law would jump through the zone at 5 (`robust`) and 7 V/s (`pid`) for ever."""
    metrics = simulate_scenario(
        {
            "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "fidelity": "static", "supply": 16}},
            "controller": law,
            "reference": {"kind": "setpoint", "position": [1, 0, 1, 0, 0, 0.5]},
            "loop": {"duration": 20},
        }
    ).metrics["steady"]
    assert metrics["input_variation"] < variation and metrics["position_rms"] < error
