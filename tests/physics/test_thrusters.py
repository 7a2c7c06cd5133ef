"""Thrusters: both directions of a motor, agreement of the fidelities at rest, order of integration, lag and axial flow."""

from itertools import pairwise
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import METHODS
from undertow.physics.thrusters import (
    DCMotor,
    axial_flow,
    commanded_thrust,
    first_order,
    linear_voltage,
    paper_table3,
    quadratic_voltage,
    t200,
    t500,
)
from undertow.physics.thrusters.fidelity_levels import FIDELITIES, with_fidelity

# A motor with everything: friction, and a propeller that is another one in reverse.
UNEVEN = DCMotor(
    resistance=0.4,
    inductance=2e-3,
    torque_constant=0.02,
    back_emf_constant=0.02,
    friction=2e-4,
    rotor_inertia=3e-4,
    thrust_coefficient=4e-4,
    torque_coefficient=4e-6,
    reverse_thrust_coefficient=3e-4,
    reverse_torque_coefficient=5e-6,
)
MOTORS = {"uneven": UNEVEN, "t200": t200().motor, "t500": t500().motor, "table3": paper_table3().motor}
EVERY_MOTOR = ["uneven", *(pytest.param(name, marks=pytest.mark.full) for name in MOTORS if name != "uneven")]
VOLTS = np.array([-20.0, -12.0, -3.0, -0.1, 0.1, 3.0, 12.0, 20.0])


WIDTH = 10  # thrusters in every simulation, so that one program serves all tests of a kind of thruster


class Volts(NamedTuple):
    """V(t) = base (1 + depth sin(rate t + phase)) of each thruster."""

    base: np.ndarray
    depth: np.ndarray
    rate: np.ndarray
    phase: np.ndarray

    def at(self, t):
        return self.base * (1 + self.depth * jnp.sin(self.rate * t + self.phase))


def swing(base, depth, rate, phase=0.0):
    base = np.asarray(base, dtype=float)
    return Volts(base, np.asarray(depth), np.asarray(rate), np.zeros(base.size) + phase)


def held(volts):
    return swing(volts, 0.0, 0.0)


def simulate(thruster, volts, duration, dt, method="rk4"):
    """State after a time under the voltages, from rest."""
    count = volts.base.size
    wide = volts._replace(base=np.resize(volts.base, WIDTH), phase=np.resize(volts.phase, WIDTH))
    end = _simulate(thruster, wide, np.asarray(dt), np.asarray(round(duration / dt)), method)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[:count], end)


@eqx.filter_jit
def _simulate(thruster, volts, dt, steps, method):
    field = lambda t, state: thruster.dynamics(state, volts.at(t))
    move = lambda k, state: METHODS[method](field, jnp.asarray(k, dtype=float) * dt, state, dt)
    return jax.lax.fori_loop(0, steps, move, thruster.initial_state(WIDTH))


def call(name, thruster, *arguments):
    """What a method of a thruster returns, compiled as a whole."""
    return jax.tree.map(np.asarray, _call(name, thruster, *arguments))


@eqx.filter_jit
def _call(name, thruster, *arguments):
    return getattr(thruster, name)(*arguments)


def effects(thruster, state, volts):
    """Thrust, current and powers of a thruster."""
    return jax.tree.map(np.asarray, _effects(thruster, state, volts))


@eqx.filter_jit
def _effects(thruster, state, volts):
    return thruster.thrust(state, volts), thruster.current(state, volts), thruster.powers(state, volts)


# ---------------------------------------------------------------------------------------------- both directions


def test_each_direction_has_its_own_coefficients():
    speed = jnp.array([-100.0, 100.0])
    np.testing.assert_allclose(UNEVEN.thrust(speed), [-3.0, 4.0], rtol=1e-14)
    np.testing.assert_allclose(UNEVEN.torque(speed), [-0.05, 0.04], rtol=1e-14)
    np.testing.assert_allclose(UNEVEN.ideal_thrust(jnp.array([-1.0, 1.0])), [-0.02 * 60 / 0.4, 0.02 * 100 / 0.4])
    even = MOTORS["table3"]
    np.testing.assert_array_equal(even.thrust(speed), -even.thrust(speed)[::-1])


@pytest.mark.parametrize("name", EVERY_MOTOR)
def test_steady_speed_solves_eq_13_in_both_directions(name):
    motor = MOTORS[name]

    @jax.jit
    def voltages(volts):
        speed = motor.steady_speed(volts)
        back = motor.resistance * motor.steady_current(speed) + motor.back_emf_constant * speed
        return motor.k2 * speed + motor.k3 * motor.torque(speed), back

    sides, back = voltages(VOLTS)
    np.testing.assert_allclose(sides, VOLTS, rtol=1e-12)
    np.testing.assert_allclose(back, VOLTS, rtol=1e-12, err_msg="and Ohm's law")


@pytest.mark.parametrize("name", EVERY_MOTOR)
def test_thrust_and_speed_are_inverse(name):
    motor, speed = MOTORS[name], np.linspace(-300, 300, 61)
    there_and_back = jax.jit(lambda speed: motor.speed_at(motor.thrust(speed)))
    np.testing.assert_allclose(there_and_back(speed), speed, rtol=1e-13)


@pytest.mark.full
@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_gradients_are_finite_at_rest(fidelity):
    """Where the square root of Eq. (11) has none."""
    thruster = with_fidelity(UNEVEN, fidelity)

    def total(volts):
        state = thruster.initial_state(2)
        flows = thruster.powers(state, volts)
        return sum(leaf.sum() for leaf in (thruster.thrust(state, volts), thruster.current(state, volts), *flows))

    assert np.isfinite(jax.jit(jax.grad(total))(np.zeros(2))).all()


# ------------------------------------------------------------------------------------------------------ fidelities


@pytest.mark.parametrize("name", ["uneven", pytest.param("t200", marks=pytest.mark.full)])
@pytest.mark.parametrize("fidelity", ["shaft", "electromechanical"])
def test_dynamic_rungs_settle_on_the_static_one(name, fidelity):
    motor, static = MOTORS[name], with_fidelity(MOTORS[name], "static")
    thruster = with_fidelity(motor, fidelity)
    state = simulate(thruster, held(VOLTS), 6.0, 2e-4)
    *found, powers = effects(thruster, state, VOLTS)
    *expected, expected_powers = effects(static, (), VOLTS)
    np.testing.assert_allclose(found, expected, rtol=1e-8)
    np.testing.assert_allclose(powers, expected_powers, rtol=1e-7, atol=1e-9)


def test_ideal_rung_is_the_static_one_without_speed_term_in_both_directions():
    constants = {"friction": 0.0, "back_emf_constant": 1e-9}
    motor = eqx.tree_at(
        lambda m: [getattr(m, name) for name in constants], UNEVEN, list(map(jnp.asarray, constants.values()))
    )
    ideal, static = with_fidelity(motor, "ideal"), with_fidelity(motor, "static")
    np.testing.assert_allclose(effects(ideal, (), VOLTS)[:2], effects(static, (), VOLTS)[:2], rtol=1e-5)


def test_speed_term_and_thrust_add_up_in_reverse_too():
    """Eq. (15), T = alpha V + phi - alpha L I_dot, with the one alpha of forward motion."""
    thruster, rng = with_fidelity(UNEVEN, "electromechanical"), np.random.default_rng(3)
    speed, current = jnp.asarray(100 * rng.normal(size=8)), jnp.asarray(8 * rng.normal(size=8))
    state = thruster.initial_state(8)._replace(speed=speed, current=current)
    assert (state.speed < 0).any() and (state.speed > 0).any()
    rates, report = call("dynamics", thruster, state, VOLTS), thruster.report(state)
    np.testing.assert_array_equal(report.speed, state.speed)
    np.testing.assert_allclose(report.acceleration, rates.speed, rtol=1e-14)
    alpha = thruster.voltage_gain()
    total = alpha * VOLTS + thruster.speed_term(report) - alpha * UNEVEN.inductance * rates.current
    np.testing.assert_allclose(
        effects(thruster, state, VOLTS)[0], total, rtol=0, atol=1e-11 * np.abs(alpha * VOLTS).max()
    )


@pytest.mark.parametrize("make", [t200, pytest.param(t500, marks=pytest.mark.full)], ids=["t200", "t500"])
@pytest.mark.parametrize(
    "fidelity",
    ["static", "electromechanical", *(pytest.param(name, marks=pytest.mark.full) for name in ("ideal", "shaft"))],
)
def test_dead_zone_of_real_thrusters(make, fidelity):
    thruster = make(fidelity)
    inside = np.array([-1.2, -0.6, 0.0, 0.6, 1.2])
    state = thruster.initial_state(5)
    thrust_and_rates = jax.jit(lambda state, volts: (thruster.thrust(state, volts), thruster.dynamics(state, volts)))
    for nothing in jax.tree.leaves(thrust_and_rates(state, inside)):
        np.testing.assert_array_equal(nothing, 0.0)
    just = np.resize([-1.21, 1.21], 5)
    outside, _ = thrust_and_rates(simulate(thruster, held(just), 0.2, 1e-4), just)
    assert outside[0] < 0 < outside[1]


@pytest.mark.parametrize(
    "thruster", [t200("static"), linear_voltage(), first_order(), axial_flow(), commanded_thrust()]
)
def test_a_speed_sensor_is_refused_where_there_is_no_speed(thruster):
    assert thruster.report(thruster.initial_state(2)) is None
    with pytest.raises(BadInput, match="`speed_sensor` must be false"):
        thruster.speed_term(None)


def test_a_speed_without_its_rate_is_not_enough_for_the_speed_term():
    """Eq. (15) wants Om_dot, which without inductance depends on the voltage that Eq. (23) asks for."""
    thruster = t200("shaft")
    state = thruster.initial_state(2)._replace(speed=np.array([3.0, -5.0]))
    report = thruster.report(state)
    np.testing.assert_array_equal(report.speed, [3.0, -5.0])
    assert report.acceleration is None
    with pytest.raises(BadInput, match="`speed_sensor` must be false on fidelity `shaft`"):
        thruster.speed_term(report)


# ------------------------------------------------------------------------------------------ order of integration

DYNAMIC = {
    "shaft": (with_fidelity(UNEVEN, "shaft"), 12.0, 4e-3),
    "electromechanical": (with_fidelity(UNEVEN, "electromechanical"), 12.0, 1e-3),
    "paper": (paper_table3("electromechanical"), 12.0, 1e-3),
    "first_order": (first_order(time_constant=0.05), 12.0, 1e-2),
    "axial_flow": (axial_flow(), 3.0, 1e-2),
    "commanded_thrust": (commanded_thrust(time_constant=0.05), 12.0, 1e-2),
}


@pytest.mark.full
@pytest.mark.parametrize("sign", [1, -1], ids=["forward", "reverse"])
@pytest.mark.parametrize(("method", "order"), [("rk4", 4), ("euler", 1)])
@pytest.mark.parametrize("name", DYNAMIC)
def test_every_dynamic_thruster_converges_at_the_order_of_the_method(name, method, order, sign):
    """One direction, beyond the dead zone: n|n| is smooth there. Steps h, h/2, h/4, h/8."""
    thruster, size, dt = DYNAMIC[name]
    volts = swing(np.full(3, sign * size), 0.3, 7.0, np.arange(3.0))
    start = 1 if method == "rk4" else 8
    ends = [np.concatenate(simulate(thruster, volts, 0.24, dt / start / 2**k, method)).astype(float) for k in range(4)]
    gaps = np.array([np.abs(a - b).max() for a, b in pairwise(ends)])
    assert gaps[-1] > 1e-12 * np.abs(ends[-1]).max(), "above rounding"
    found = np.log2(gaps[:-1] / gaps[1:])
    assert abs(found[-1] - order) < 0.2, (gaps, found)
    assert abs(found[-1] - order) <= abs(found[0] - order) + 0.05, "and ever more nearly so"


# --------------------------------------------------------------------------------------------------- first_order


def test_first_order_step_response():
    """T = c V (1 - exp(-t / tau)), 63 % after tau; in reverse a share of it."""
    thruster = first_order(thrust_per_volt=2.0, time_constant=0.2, reverse_share=0.75)
    volts = np.array([-8.0, 8.0])
    for t, rest in ((0.2, np.exp(-1)), (0.5, np.exp(-2.5))):
        found = simulate(thruster, held(volts), t, 1e-3).thrust
        np.testing.assert_allclose(found, np.array([-12.0, 16.0]) * (1 - rest), rtol=1e-9)


@pytest.mark.full
def test_first_order_tends_to_the_static_models():
    """At first order in tau, linear and quadratic, while the voltage moves."""
    volts = swing([6.0, 12.0], 0.5, 5.0)
    models = (
        (linear_voltage(4.0), {"thrust_per_volt": 4.0}),
        (quadratic_voltage(0.3), {"thrust_per_volt": 0.3, "power": 2.0, "linear_gain": 3.0}),
    )
    for static, options in models:
        expected = call("thrust", static, (), np.asarray(volts.at(1.0)))
        ends = [
            simulate(first_order(**options, time_constant=tau), volts, 1.0, 1e-4).thrust for tau in (2e-3, 1e-3, 5e-4)
        ]
        gaps = [float(np.abs(end / expected - 1).max()) for end in ends]
        assert gaps[-1] < 2e-3
        np.testing.assert_allclose(np.divide(gaps[:-1], gaps[1:]), 2.0, atol=0.1)


def test_first_order_draws_the_current_of_its_steady_state():
    thruster = first_order(current_per_thrust=0.1, dead_zone=1.0)
    volts = np.array([-5.0, -0.5, 0.5, 5.0])
    moving = thruster.initial_state(4)._replace(thrust=np.array([30.0, 30.0, -30.0, -30.0]))
    both = jax.jit(lambda state, volts: (thruster.current(state, volts), thruster.terminal(volts)))
    current, terminal = map(np.asarray, both(moving, volts))
    np.testing.assert_allclose(current, [-5.45, 0.0, 0.0, 5.45])
    assert (terminal * current >= 0).all(), "nothing comes back"


def test_first_order_says_what_is_missing_or_wrong():
    with pytest.raises(BadInput, match="`linear_gain` must be given when `power` is not 1"):
        first_order(power=2.0)
    for name in ("thrust_per_volt", "time_constant", "reverse_share", "current_per_thrust", "supply"):
        with pytest.raises(BadInput, match=f"`{name}` must be positive"):
            first_order(**{name: 0.0})
    assert first_order(thrust_per_volt=3.0).voltage_gain() == 3.0


# ---------------------------------------------------------------------------------------------------- axial_flow

# Steady bench data of the thruster that the set was identified on: command V, thrust N, torque N m, speed rad/s.
BENCH = np.array(
    [
        [-3.0, -12.95, -0.0328, -111.02],
        [-2.5, -6.289, -0.0232, -86.54],
        [-2.0, -2.954, -0.0102, -61.5],
        [-1.5, -1.057, -0.00261, -36.09],
        [-1.0, -0.2438, -0.0008, -11.21],
        [1.0, 0.1952, 0.0007516, 9.798],
        [1.5, 1.2525, 0.0024, 34.71],
        [2.0, 3.475, 0.0095, 59.44],
        [2.5, 6.897, 0.0214, 84.26],
        [3.0, 11.69, 0.034, 110.1],
    ]
)  # fmt: skip


@pytest.fixture(scope="module")
def bench():
    """Settled thrust, torque and speed over those measured, and the settled thrust, by command.

    The thrust at which it settles is its steady thrust, and the command of that thrust is the one that was given.
    """
    thruster, volts = axial_flow(), BENCH[:, 0]
    state = simulate(thruster, held(volts), 30.0, 2e-3)

    @jax.jit
    def settled(state, volts):
        thrust, steady = thruster.thrust(state, volts), thruster.steady_thrust(volts)
        return thruster.dynamics(state, volts), thrust, thruster.torque(state), steady, thruster.steady_voltage(steady)

    rates, thrust, torque, steady, command = jax.tree.map(np.asarray, settled(state, volts))
    assert all(np.abs(rate).max() < 1e-6 for rate in rates)
    np.testing.assert_allclose(steady, thrust, rtol=1e-5)
    np.testing.assert_allclose(command, volts, rtol=1e-9)
    ratios = np.stack([thrust, torque, state.speed]) / BENCH[:, 1:].T
    return {float(v): (*ratios[:, i], thrust[i]) for i, v in enumerate(volts)}


def test_what_a_controller_knows_of_axial_flow_is_its_steady_curve():
    """The range of the force is that of the largest command, and has no end where the command has none."""
    volts = jnp.array([-2.5, 1.5, 3.0])

    @eqx.filter_jit
    def known(thruster):
        curve = thruster.actuator_model(3, False)
        force = curve.force((), volts)
        return (
            curve.range((), 1.0),
            force,
            curve.command((), force, 1.0),
            thruster.steady_thrust(jnp.array([-5.0, 5.0])),
        )

    (low, high), force, command, ends = jax.tree.map(np.asarray, known(axial_flow(supply=5.0)))
    np.testing.assert_allclose([low, high], ends)
    np.testing.assert_allclose(command, volts, rtol=1e-9)
    assert (np.sign(force) == np.sign(volts)).all()
    (low, high), *_ = known(axial_flow(supply=np.inf))
    assert (low, high) == (-np.inf, np.inf)


def test_axial_flow_reproduces_its_own_bench_at_full_command(bench):
    for volts, measured in ((3.0, 11.69), (-3.0, -12.95)):
        ratio, torque, speed, thrust = bench[volts]
        assert abs(speed - 1) < 0.007
        assert abs(torque - 1) < 0.05
        np.testing.assert_allclose(thrust, np.copysign(11.7, volts), atol=0.05)
        np.testing.assert_allclose(ratio, thrust / measured)


def test_axial_flow_is_less_good_below_and_poor_next_to_its_dead_zone(bench):
    """What its documentation owns up to."""
    for volts in (2.0, -2.0):
        assert abs(bench[volts][2] - 1) < 0.014
        assert 3.85 < abs(bench[volts][3]) < 4.0
    np.testing.assert_allclose([bench[2.0][0], bench[-2.0][0]], [1.125, 1.347], atol=2e-3)
    np.testing.assert_allclose([bench[-1.0][2], bench[1.0][2]], [0.80, 0.77], atol=5e-3)
    np.testing.assert_allclose([bench[-1.0][0], bench[1.0][0]], [0.47, 0.41], atol=5e-3)


def test_step_to_three_volts_overshoots_by_37_percent_because_of_the_flow():
    thruster, volts, dt = axial_flow(), jnp.array([3.0]), 2e-3

    @eqx.filter_jit
    def course(thruster):
        def step(state, _):
            state = METHODS["rk4"](lambda t, s: thruster.dynamics(s, volts), jnp.zeros(()), state, dt)
            return state, thruster.thrust(state, volts)[0]

        return jax.lax.scan(step, thruster.initial_state(1), None, length=15000)[1]

    thrust = np.asarray(course(thruster))
    np.testing.assert_allclose(thrust.max() / thrust[-1], 1.366, atol=2e-3)
    np.testing.assert_allclose(dt * (thrust.argmax() + 1), 0.309, atol=5e-3)
    stiff = np.asarray(course(eqx.tree_at(lambda t: t.thrust_loss, thruster, jnp.zeros(()))))
    assert stiff.max() <= stiff[-1] * (1 + 1e-9), "negative control: without the loss of thrust to the flow"


def test_rotor_alone_has_a_time_constant_of_73_ms():
    """1 / k_n, the set's linear one, and nothing below the dead zones of -0.83 V and 0.86 V."""
    thruster = axial_flow()
    np.testing.assert_allclose(1 / thruster.speed_decay, 0.0732, atol=5e-5)
    at_rest = thruster.initial_state(4)
    rates = call("dynamics", thruster, at_rest, np.array([-0.84, -0.82, 0.85, 0.87])).speed
    np.testing.assert_allclose(rates, [-7.25469, 0.0, 0.0, 7.37156], rtol=1e-9)


def test_axial_flow_owns_up_to_what_it_does_not_know():
    assert "current" in axial_flow().advice()[0]
    known = axial_flow(current_per_torque=30.0)
    assert not known.advice()
    state = simulate(known, held([3.0]), 2.0, 2e-3)
    np.testing.assert_allclose(call("current", known, state, np.array([3.0])), 30 * 0.0344, rtol=5e-3)
