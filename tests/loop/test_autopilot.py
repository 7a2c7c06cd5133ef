"""The controller by itself: the bits of a simulation, formats, time, states, and what others do wrong."""

import jax
import numpy as np
import pytest
from scipy.optimize import brentq

import undertow as ut
from undertow.core.errors import BadInput
from undertow.core.numerics.rotations import quaternion_from_euler, rotation_from_quaternion
from undertow.outside.autopilot.clock import StepClock
from undertow.outside.autopilot.measured_motion import Format, MeasuredMotion

NOISY = {"kind": "white_noise", "position": 0.001, "velocity": 0.01}
HEAVY = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "rcaf", "preset": "robust"},
    # Begins where the plant does, not at the noisy position that is measured there.
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5], "settling": 5, "start": [0] * 6},
    "disturbance": {"kind": "current", "velocity": [0.3, 0.2, 0]},
    "navigation": NOISY,
    "loop": {"duration": 1.0, "dt": 0.01, "record": 0.01},
}
PENDULUM = {
    "plant": "inverted_pendulum",
    "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1},
    "initial": {"position": [0.05]},
    "loop": {"duration": 1.0, "dt": 0.001, "record": 0.001},
}
SHAFT = HEAVY | {
    "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "shaft", "supply": 24}},
    "model": {"speed_sensor": True},
    "navigation": {"kind": "perfect"},
}


@pytest.fixture(scope="module")
def heavy():
    """An autopilot for every test that does not change its making."""
    return ut.Autopilot(HEAVY)


def parts(values):
    """Position, velocity and attitude of recorded outputs and rates."""
    position, velocity = values
    return (position[:3], velocity, position[3:]) if len(position) == 6 else (position, velocity)


@pytest.mark.parametrize(
    "scenario",
    [
        pytest.param(HEAVY, marks=pytest.mark.full),
        PENDULUM,
        pytest.param(HEAVY | {"controller": {"kind": "pid", "frequency": 2.0}}, marks=pytest.mark.full),
    ],
)
def test_every_bit_is_that_of_a_simulation(scenario):
    record = ut.simulate_scenario(scenario).dataset
    names = ("measured_position", "measured_velocity", "input", "commanded_input")
    positions, velocities, applied, expected = (record[name].values for name in names)
    autopilot = ut.Autopilot(scenario, velocity="rates")
    assert autopilot.backend == "simd"
    found = [autopilot.start(*parts((positions[0], velocities[0])))]
    for k in range(1, len(positions) - 1):
        found.append(autopilot.step(*parts((positions[k], velocities[k])), applied=applied[k - 1]))
    np.testing.assert_array_equal(found, expected[:-1])


@pytest.mark.full
def test_propeller_speeds_are_measured():
    """Without them the law holds the speeds of the start: another command from the second step on."""
    with_speeds, without = ut.Autopilot(SHAFT), ut.Autopilot(SHAFT)
    for autopilot in (with_speeds, without):
        autopilot.start(np.zeros(3), np.zeros(6), np.zeros(3))
    first = with_speeds.step(np.zeros(3), np.zeros(6), np.zeros(3), propellers=np.full(8, 20.0))
    second = without.step(np.zeros(3), np.zeros(6), np.zeros(3))
    assert np.isfinite(first).all() and np.isfinite(second).all() and np.abs(first - second).max() > 0.1


@pytest.mark.full
def test_formats_describe_one_motion(heavy):
    """Euler angles or quaternion, velocity in body axes, world axes or as rates of the angles."""
    position, angles, nu = [1.0, -2.0, 3.0], np.array([0.3, -0.4, 1.2]), np.array([0.5, 0.1, -0.2, 0.3, -0.1, 0.2])
    quaternion = np.asarray(quaternion_from_euler(angles))
    rotation = np.asarray(rotation_from_quaternion(quaternion))
    world = np.concatenate([rotation @ nu[:3], rotation @ nu[3:]])
    roll, pitch, _ = angles  # textbook: Euler rates of body rates, Fossen (2021), Eq. (2.26)
    rates = np.array(
        [
            [1, np.sin(roll) * np.tan(pitch), np.cos(roll) * np.tan(pitch)],
            [0, np.cos(roll), -np.sin(roll)],
            [0, np.sin(roll) / np.cos(pitch), np.cos(roll) / np.cos(pitch)],
        ]
    )
    forms = {
        ("euler", "body"): (angles, nu),
        ("quaternion", "body"): (quaternion, nu),
        ("quaternion", "world"): (2.0 * quaternion, world),  # of any length
        ("euler", "rates"): (angles, np.concatenate([world[:3], rates @ nu[3:]])),
        ("both", "both"): (np.concatenate([angles, quaternion]), np.concatenate([world[:3], rates @ nu[3:], nu])),
    }
    expected = heavy.start(position, nu, angles)
    for (attitude, velocity), (turned, moving) in forms.items():
        found = ut.Autopilot(HEAVY, attitude=attitude, velocity=velocity).start(position, moving, turned)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_both_forms_of_a_motion_belong_together():
    for form in (Format("both", "body"), Format("euler", "both")):
        with pytest.raises(BadInput, match="both"):
            form.check()


def test_a_quaternion_that_was_integrated_is_taken_as_it_is():
    """So a controller has the bits of a simulation, whose quaternion departs a little from unit length."""
    unit = np.asarray(jax.jit(quaternion_from_euler)(np.array([0.3, -0.4, 1.2])))
    measured = jax.jit(lambda motion: Format("quaternion", "body").measurement(motion, None))
    for longer, same in ((1 + 1e-11, True), (1 + 1e-6, False)):
        body = measured(MeasuredMotion(np.zeros(3), longer * unit, np.zeros(6))).body
        assert body is not None
        found = np.asarray(body.attitude)
        assert (found == longer * unit).all() == same
        np.testing.assert_allclose(np.linalg.norm(found), 1.0, rtol=1e-10)


@pytest.mark.full
def test_outputs_are_one_command(heavy):
    """Thrust in newtons is that of the thruster's steady curve; pulses and the wrench follow from volts and thrust."""
    at = (np.zeros(3), np.zeros(6), np.zeros(3))
    goal = [1.0, 0.5, 0.2, 0.0, 0.0, 0.1]
    volts = heavy.start(*at, target=goal)
    newtons, pulses, wrench = (
        ut.Autopilot(HEAVY, output=output).start(*at, target=goal) for output in ("newtons", "pulses", "wrench")
    )
    motor = ut.thrusters.t200(supply=16).motor
    speeds = [brentq(lambda speed, v=v: float(motor.steady_voltage(speed)) - v, -1e3, 1e3, xtol=1e-12) for v in volts]
    np.testing.assert_allclose(newtons, motor.thrust(np.array(speeds)), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(pulses, np.round(1500 + 400 * volts / 16), atol=1.0)
    layout = np.asarray(ut.vehicles.bluerov2_heavy().thruster_matrix())
    np.testing.assert_allclose(wrench, layout @ newtons, rtol=1e-9, atol=1e-12)


@pytest.mark.full
def test_a_saved_state_goes_on_bit_for_bit(heavy):
    chance = np.random.default_rng(0)
    motions = [(chance.normal(size=3), 0.1 * chance.normal(size=6), 0.1 * chance.normal(size=3)) for _ in range(20)]
    heavy.start(*motions[0])
    for motion in motions[1:10]:
        heavy.step(*motion)
    state = heavy.save()
    expected = [heavy.step(*motion) for motion in motions[10:]]
    other = ut.Autopilot(HEAVY)
    other.restore(state)
    np.testing.assert_array_equal([other.step(*motion) for motion in motions[10:]], expected)
    assert other.counts == heavy.counts and other.signals().keys() == heavy.declared_signals().keys()


@pytest.mark.full
def test_damaged_and_foreign_states_change_nothing(heavy):
    heavy.start(np.zeros(3), np.zeros(6), np.zeros(3))
    state, chance = heavy.save(), np.random.default_rng(1)
    for _ in range(200):
        damaged = bytearray(state)
        place = chance.integers(len(damaged))
        damaged[place] ^= int(chance.integers(1, 256))
        with pytest.raises(BadInput, match="state"):
            heavy.restore(bytes(damaged))
    for wrong in (b"", state[:-1], state[:40], state + b"x", "text"):
        with pytest.raises(BadInput, match="state"):
            heavy.restore(wrong)  # pyright: ignore[reportArgumentType]
    with pytest.raises(BadInput, match="of the same controller"):
        ut.Autopilot(HEAVY | {"controller": {"kind": "rcaf", "preset": "robust", "layer": 0.123}}).restore(state)
    assert heavy.save() == state


@pytest.mark.full
def test_control_starts_without_a_jump(heavy):
    """The output is first the one that was applied, and the law's after some time constants."""
    at = (np.zeros(3), np.zeros(6), np.zeros(3))
    before = np.linspace(-3, 3, 8)
    np.testing.assert_array_equal(heavy.start(*at, target=np.zeros(6), applied=before), before)
    largest = 0.0
    last = before
    for _ in range(1000):
        volts = heavy.step(*at, target=np.zeros(6))
        largest, last = max(largest, np.abs(volts - last).max()), volts
    assert largest < 0.5
    np.testing.assert_allclose(last, heavy.signals()["command"], atol=1e-3)


@pytest.mark.full
def test_missing_readings_are_replaced(heavy):
    """The law goes on with what its model expects, also where nothing at all is measured."""
    at = (np.zeros(3), np.zeros(6), np.zeros(3))
    heavy.start(*at, target=np.zeros(6))
    for hole in ((np.full(3, np.nan), *at[1:]), (at[0], np.full(6, np.inf), at[2]), (*at[:2], np.full(3, np.nan))):
        assert np.isfinite(heavy.step(*hole, target=np.zeros(6))).all()
    nothing = (np.full(3, np.nan), np.full(6, np.nan), np.full(3, np.nan))
    assert all(np.isfinite(heavy.step(*nothing, target=np.zeros(6))).all() for _ in range(100))


@pytest.mark.full
def test_a_law_whose_integral_one_wrong_number_has_wound_up_starts_again():
    """One velocity of 9e5 m/s: afterwards the law answers to an error of 0.3 m as one that never saw it."""
    scenario = {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
        "controller": {"kind": "pid", "frequency": 1},
        "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
        "loop": {"dt": 0.02, "record": 0.02},
    }
    law = ut.Autopilot(scenario)
    rest, away = (np.zeros(3), np.zeros(6), np.zeros(3)), np.array([0.3, 0, 0, 0, 0, 0])
    law.start(*rest, target=away)
    expected = law.step(*rest, target=away)
    law.start(*rest, target=away)
    law.step(np.zeros(3), np.array([9e5, 0, 0, 0, 0, 0]), np.zeros(3), target=away)
    for _ in range(3):
        answer = law.step(*rest, target=away)
    assert law.counts["restarted"] == 1
    np.testing.assert_allclose(answer, expected, rtol=0.05, atol=0.02)


@pytest.mark.full
def test_a_law_that_is_no_number_any_more_starts_again(heavy):
    """An applied input that overflows while the thrusters give all they can; then the vehicle is at its target."""
    at, far = (np.zeros(3), np.zeros(6), np.zeros(3)), np.array([8.0, 1, 1, 0, 0, 0.5])
    heavy.start(*at, target=far)
    for _ in range(50):
        full = heavy.step(*at, target=far)
    assert np.abs(full).max() == pytest.approx(16)
    assert (heavy.step(*at, target=far, applied=np.full(8, 1e300)) == full).all()
    found = np.array([heavy.step(*at, target=np.zeros(6)) for _ in range(100)])
    assert heavy.counts["restarted"] == 1
    heavy.start(*at, target=np.zeros(6))
    anew = np.array([heavy.step(*at, target=np.zeros(6)) for _ in range(99)])
    np.testing.assert_allclose(found[1:], anew, atol=0.05)

    heavy.step(*at, target=far, applied=np.full(8, 1e300))
    missing = np.full(3, np.nan)
    silent = [heavy.step(missing, *at[1:], target=far) for _ in range(5)]
    assert not np.any(silent[1:]), "without a measurement it cannot start, and gives nothing"
    assert heavy.step(*at, target=far).any()


def test_late_missed_and_repeated_steps():
    clock = StepClock(0.01)
    assert [clock.passed(dt) for dt in (None, 0.01, 0.012, 0.015, 0.05, 10.0)] == [0.01, 0.01, 0.012, 0.015, 0.05, 0.05]
    assert [clock.passed(dt) for dt in (0.0, -1.0, np.nan, np.inf)] == [0.0] * 4
    assert clock.counts == {"steps": 10, "late": 1, "missed": 2, "repeated": 4}
    assert clock.time == pytest.approx(0.01 + 0.01 + 0.012 + 0.015 + 0.05 + 10.0)


@pytest.mark.full
def test_a_repeated_step_changes_nothing(heavy):
    at = (np.ones(3), np.zeros(6), np.zeros(3))
    heavy.start(np.zeros(3), np.zeros(6), np.zeros(3))
    last = heavy.step(*at)
    weights = heavy.signals()["weights"]
    np.testing.assert_array_equal(heavy.step(5 * np.ones(3), *at[1:], dt=0.0), last)
    np.testing.assert_array_equal(heavy.signals()["weights"], weights)


@pytest.mark.full
@pytest.mark.parametrize(
    "change, said",
    [
        ({"position": np.zeros(2)}, r"`position` must have shape \(3,\), but is of shape \(2,\)"),
        ({"velocity": "fast"}, "`velocity` must be numbers"),
        ({"attitude": np.zeros(4)}, r"`attitude` must have shape \(3,\)"),
        ({"target": [np.nan] * 6}, r"`target\[0\]` must be a finite number"),
        ({"target": np.zeros(3)}, r"`target` must have shape \(6,\)"),
        ({"applied": np.zeros(6)}, r"`applied` must have shape \(8,\)"),
        ({"propellers": np.zeros(7)}, r"`propellers` must have shape \(8,\)"),
        ({"propellers": (np.zeros(8), np.zeros(8))}, "`propellers` must be the speeds alone"),
    ],
)
def test_what_is_given_wrongly(heavy, change, said):
    given = {"position": np.zeros(3), "velocity": np.zeros(6), "attitude": np.zeros(3)}
    heavy.start(**given)
    state = heavy.save()
    with pytest.raises(BadInput, match=said):
        heavy.step(**(given | change))
    assert heavy.save() == state


@pytest.mark.full
def test_what_a_driver_has_not_yet_is_not_measured_and_not_reported():
    """A quaternion of zeros is none; an applied input that is no number is the commanded one."""
    autopilot = ut.Autopilot(HEAVY, attitude="quaternion")
    at, level, zeros = (np.zeros(3), np.zeros(6)), np.array([1.0, 0, 0, 0]), np.zeros(4)
    found = []
    for attitude, applied in (
        (np.full(4, np.nan), None),
        (zeros, np.full(8, np.nan)),
        (1e200 + zeros, np.full(8, np.inf)),
    ):
        autopilot.start(*at, level)
        autopilot.step(*at, level)
        found.append([autopilot.step(*at, attitude, applied=applied) for _ in range(3)])
    np.testing.assert_array_equal(found[1:], [found[0]] * 2)


@pytest.mark.full
def test_what_an_autopilot_cannot_be_made_of():
    cases = [
        ({"attitude": "degrees"}, "`attitude` must be one of euler, quaternion"),
        ({"output": "pwm"}, "`output` must be one of input, newtons, pulses, wrench"),
        ({"sampling_time": 0.0}, "`sampling_time` must be positive"),
    ]
    for options, said in cases:
        with pytest.raises(BadInput, match=said):
            ut.Autopilot(HEAVY, **options)
    with pytest.raises(BadInput, match="`output` must be `input` for a plant that is no vehicle"):
        ut.Autopilot(PENDULUM, output="newtons")
    pendulum = ut.Autopilot(PENDULUM)
    with pytest.raises(BadInput, match="`start` must be called before `step`"):
        pendulum.step([0.0], [0.0])
    with pytest.raises(BadInput, match="`propellers` must be left out: the actuators of this plant report nothing"):
        pendulum.start([0.0], [0.0], propellers=[1.0])


@pytest.mark.full
def test_gains_are_those_of_the_sampling_time():
    slow = PENDULUM | {"loop": {"duration": 1.0, "dt": 0.02, "record": 0.02}}
    given, of_scenario = ut.Autopilot(PENDULUM, sampling_time=0.02), ut.Autopilot(slow)
    assert given.sampling_time == of_scenario.sampling_time == 0.02
    for autopilot in (given, of_scenario):
        autopilot.start([0.05], [0.0])
    steps = [(given.step([x], [0.1]), of_scenario.step([x], [0.1])) for x in (0.052, 0.054, 0.056)]
    for ours, theirs in steps:
        np.testing.assert_array_equal(ours, theirs)
    as_it_is = ut.Autopilot(PENDULUM)
    as_it_is.start([0.05], [0.0])
    assert as_it_is.step([0.052], [0.1], dt=0.02) != steps[0][0]  # with gains for 1 ms


@pytest.mark.full
def test_the_reference_begins_where_the_vehicle_is_found():
    """With an open start: at rest at 5 m there is nothing to correct yet, at another start likewise."""
    reference = {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0], "settling": 100}
    autopilot = ut.Autopilot(HEAVY | {"reference": reference, "disturbance": {"kind": "none"}})
    at_origin = autopilot.start(np.zeros(3), np.zeros(6), np.zeros(3))
    for place in ([5.0, 5.0, 5.0], [55.0, -3.0, 0.0]):
        first = autopilot.start(place, np.zeros(6), np.zeros(3))
        np.testing.assert_allclose(first, at_origin, atol=1e-9)
        for _ in range(30):
            later = autopilot.step(place, np.zeros(6), np.zeros(3))
        assert np.abs(later).max() < 10.0  # a step of 5 m saturates at 16 V


@pytest.mark.full
def test_a_start_that_is_none_holds_nothing_of_an_earlier_one(heavy):
    """A start with a quaternion of no length is refused, and the controller goes on; another forgets the old command."""
    autopilot = ut.Autopilot(HEAVY, attitude="quaternion")
    upright = [1.0, 0, 0, 0]
    autopilot.start(np.zeros(3), np.zeros(6), upright, target=[5.0, 0, 0, 0, 0, 0])
    before = autopilot.step(np.zeros(3), np.zeros(6), upright, target=[5.0, 0, 0, 0, 0, 0])
    state = autopilot.save()
    with pytest.raises(BadInput, match="quaternion of some length"):
        autopilot.start(np.zeros(3), np.zeros(6), np.zeros(4))
    assert autopilot.save() == state and np.abs(before).max() > 1.0
    autopilot.start(np.zeros(3), np.zeros(6), upright, target=[0.0] * 6)
    after = autopilot.step(np.zeros(3), np.zeros(6), upright, target=[0.0] * 6)
    fresh = ut.Autopilot(HEAVY, attitude="quaternion")
    fresh.start(np.zeros(3), np.zeros(6), upright, target=[0.0] * 6)
    np.testing.assert_array_equal(after, fresh.step(np.zeros(3), np.zeros(6), upright, target=[0.0] * 6))


@pytest.mark.full
def test_a_target_may_be_a_tuple_of_numbers_and_not_ragged(heavy):
    heavy.start(np.zeros(3), np.zeros(6), np.zeros(3))
    flat = heavy.step(np.zeros(3), np.zeros(6), np.zeros(3), target=(1, 0, 0, 0, 0, 0))
    assert np.isfinite(flat).all()
    with pytest.raises(BadInput, match="`target`"):
        heavy.step(np.zeros(3), np.zeros(6), np.zeros(3), target=[[1, 0, 0, 0, 0, 0], [0]])
