"""References: velocity and acceleration belong to the position, joints are smooth, and closed forms are met."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from messages import named

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references import circle, helix, lawn_mower, line, lissajous, recorded, setpoint, sine, waypoints
from undertow.control.references.setpoint import Transition
from undertow.core.errors import BadInput
from undertow.physics.disturbances.none import none
from undertow.physics.plants.double_integrator import double_integrator
from undertow.scenario import factory
from undertow.scenario.results.run_scenario import run_scenario
from undertow.simulation.loop import continuous, sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

RNG = np.random.default_rng(4)
SQUARE = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 1], [0, 4, 1], [0, 0, 0.5]], dtype=float)
ROWS = np.column_stack([[0, 1, 2.5, 3, 6], RNG.normal(size=(5, 6))])
SQUARE_TIMES = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(SQUARE, axis=0), axis=1))]) / 0.5
ARC = np.pi / 2  # of the lawn mower below, m
# Distance s is reached at s / speed + ramp / 2.
MOWER_JOINTS = np.cumsum([5, ARC, 5, ARC])[:4] / 0.5 + 1.5

# Name: reference, joints (s), duration (s).
CASES = {
    "settling": (setpoint([1.0, -2.0, 0.5, 0.0, 0.1, 2.0], 5.0, np.linspace(0, 1, 6)), [0, 5], 7),
    "one axis": (setpoint([1.0], 2.0), [0, 2], 3),
    "circle": (circle(heading="along"), [], 50),
    "helix": (helix(heading="along"), [], 50),
    "lissajous": (lissajous((2, 1, 0.5, 0.3), (0.1, 0.2, 0.3, 0.4), (0, 1, 2, 3), 4.0), [], 50),
    "line": (line((3, 4, 1), 0.5, (0, 1, 0), 2.0, "along"), [0, 2, np.sqrt(19) / 0.5, np.sqrt(19) / 0.5 + 2], 15),
    "lawn mower": (
        lawn_mower(5.0, 1.0, 3, 0.5, 3.0, 2.0, "along"),
        [0, 3, *MOWER_JOINTS, (15 + 2 * ARC) / 0.5, (15 + 2 * ARC) / 0.5 + 3],
        45,
    ),
    "waypoints": (waypoints(SQUARE, 0.5, "along"), SQUARE_TIMES, 40),
    "recorded": (recorded(ROWS), ROWS[:, 0], 8),
    "sine": (sine([2.0, 0.5], [0.4, 1.1], [1.0, -1.0], [0.3, 0.0]), [], 50),
}
# Where the acceleration jumps (s).
JUMPS = {"lawn mower": MOWER_JOINTS, "waypoints": SQUARE_TIMES[[0, -1]], "recorded": ROWS[[0, -1], 0]}


DEAR = {"lawn mower", "line", "one axis"}  # left out of the quick set, which has closed forms of them


@pytest.fixture(
    scope="module", params=[pytest.param(name, marks=pytest.mark.full) if name in DEAR else name for name in CASES]
)
def case(request):
    reference, joints, duration = CASES[request.param]
    return request.param, reference, np.asarray(joints, dtype=float), duration


def at(reference, times):
    """Position, velocity and acceleration, one row per time."""
    return with_slopes(reference, times)[0]


def with_slopes(reference, times):
    """The same, and their derivatives by automatic differentiation."""
    times = np.asarray(times, dtype=float)
    parts = [_at(reference, np.resize(times[i : i + CHUNK], CHUNK)) for i in range(0, max(len(times), 1), CHUNK)]
    return jax.tree.map(lambda *part: np.concatenate(part)[: len(times)], *parts)


CHUNK = 1024  # as many times in every call: one program for each kind of reference


@eqx.filter_jit
def _at(reference, times):
    return jax.vmap(lambda t: jax.jvp(lambda t: list(reference.at(t)), (t,), (jnp.ones_like(t),)))(times)


def test_derivatives_are_exact(case):
    """By automatic differentiation, and by differences, which owe nothing to the implementation."""
    _, reference, joints, duration = case
    times = np.concatenate([RNG.uniform(-1, duration, 200), joints - 1e-4, joints + 1e-4])
    (_, velocity, acceleration), slopes = with_slopes(reference, times)
    np.testing.assert_allclose(slopes[0], velocity, rtol=0, atol=1e-12)
    np.testing.assert_allclose(slopes[1], acceleration, rtol=0, atol=1e-12)
    step = 1e-5
    for order, rate in enumerate((velocity, acceleration)):
        difference = (at(reference, times + step)[order] - at(reference, times - step)[order]) / (2 * step)
        np.testing.assert_allclose(difference, rate, rtol=0, atol=1e-8)


def test_joints_are_smooth(case):
    """Position and velocity everywhere; acceleration too, but where it is said to jump."""
    name, reference, joints, _ = case
    before, after = at(reference, joints - 1e-9), at(reference, joints + 1e-9)
    for order in range(2):
        np.testing.assert_allclose(before[order], after[order], rtol=0, atol=1e-7)
    jumps = np.abs(before[2] - after[2]).max(1) if joints.size else np.zeros(0)
    said = np.isin(joints, JUMPS.get(name, []))
    assert (jumps[~said] < 1e-6).all()
    assert (jumps[said] > 1e-3).all()


@pytest.mark.full
def test_gradients_are_finite(case):
    """With respect to every parameter: inside, at every joint and long after, headings included."""
    _, reference, joints, duration = case
    arrays, rest = eqx.partition(reference, eqx.is_inexact_array)
    slopes = eqx.filter_jit(jax.vmap(jax.jacrev(lambda arrays, t: eqx.combine(arrays, rest).at(t)), (None, 0)))
    for leaf in jax.tree.leaves(slopes(arrays, jnp.array([-1.0, 0.0, 0.7 * duration, 1e4, *joints]))):
        assert np.isfinite(leaf).all()


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.full) if name in DEAR else name
        for name, (_, joints, _) in CASES.items()
        if len(joints)
    ],
)
def test_held_before_and_after(name):
    reference, joints, duration = CASES[name]
    position, velocity, acceleration = at(reference, [-1e3, joints[0], joints[-1], duration, 1e6])
    np.testing.assert_allclose(position[0], position[1], rtol=0, atol=1e-14)
    np.testing.assert_allclose(position[3:], position[[2, 2]], rtol=0, atol=1e-14)
    assert not velocity[[0, 3, 4]].any() and not acceleration[[0, 3, 4]].any()


def test_step_is_a_constant():
    goal = np.array([2.0, -3.0, 4.0, 0.0, 0.0, 1.0])
    step = setpoint(goal)
    assert len(jax.tree.leaves(step)) == 1
    position, velocity, acceleration = at(step, [-1.0, 0.0, 3.0])
    np.testing.assert_array_equal(position, np.tile(goal, (3, 1)))
    assert not velocity.any() and not acceleration.any()


def test_a_transition_that_takes_no_time_is_a_step():
    goal = jnp.array([3.0, -1.0])
    move = jax.jit(lambda settling, t: Transition(settling, jnp.ones(2)).to(goal, t))
    for t in (0.0, 1.0):
        np.testing.assert_array_equal(move(0.0, t), [goal, [0, 0], [0, 0]])
    np.testing.assert_array_equal(move(2.0, 0.0).position, [1.0, 1.0])


def test_settling_takes_its_time():
    start, goal = np.array([1.0, 0.0]), np.array([3.0, -1.0])
    times = np.linspace(0, 4, 4001)
    position, velocity, acceleration = at(setpoint(goal, 4.0, start), times)
    np.testing.assert_array_equal(position[[0, -1]], [start, goal])
    np.testing.assert_allclose(position[2000], (start + goal) / 2, rtol=1e-15)
    np.testing.assert_allclose(np.abs(velocity).max(0), 1.875 * np.abs(goal - start) / 4, rtol=1e-12)
    np.testing.assert_allclose(np.abs(acceleration).max(0), 10 / np.sqrt(3) * np.abs(goal - start) / 16, rtol=1e-6)


@pytest.mark.full
def test_settling_starts_where_the_plant_does_unless_told():
    """A cart and a vehicle that start away from zero are not sent to zero and back; a step and a given start stay."""
    goal, begun = np.array([3.0, -1.0]), np.array([5.0, 2.0])
    for told, start in ((None, begun), ([1.0, 0.0], [1.0, 0.0])):
        position, _, _ = at(setpoint(goal, 4.0, told).starting_at(begun), np.linspace(0, 4, 401))
        np.testing.assert_array_equal(position[[0, -1]], [start, goal])
        assert (position <= np.maximum(start, goal) + 1e-12).all() and (
            position >= np.minimum(start, goal) - 1e-12
        ).all()
    np.testing.assert_array_equal(at(setpoint(goal).starting_at(begun), [0.0])[0], [goal])
    cart = {
        "plant": "inverted_pendulum",
        "controller": {"kind": "pid", "frequency": 4.0},
        "reference": {"kind": "setpoint", "position": [0.05], "settling": 1.0},
        "loop": {"duration": 0.1, "dt": 0.01},
        "initial": {"position": [0.1]},
    }
    assert float(run_scenario(cart).dataset["reference"][0, 0]) == 0.1
    plant = double_integrator(2)
    for simulate in (sampled.simulate, continuous.simulate):
        law = rcaf(plant.model(), preset="paper", sets=3)
        loop = ClosedLoop(plant, law, setpoint(goal, 4.0), none(), perfect())
        found = simulate(loop, duration=0.1, dt=0.01, position=begun)
        np.testing.assert_array_equal(found.signals["reference"][0], begun)


@pytest.mark.full
def test_settling_may_be_traced_and_zero():
    """As an unknown it is zero without harm: the step, and finite gradients."""
    values = lambda settling, t: setpoint(jnp.array([-2.0, 1.0]), settling, jnp.ones(2)).at(t)
    for t in (0.0, 1.0):
        now = [np.asarray(v) for v in jax.jit(values)(0.0, t)]
        np.testing.assert_array_equal(now, [[-2.0, 1.0], [0, 0], [0, 0]])
        for slope in jax.jit(jax.jacrev(values))(0.0, t):
            assert np.isfinite(slope).all()


def test_circle_looks_where_it_goes():
    position, velocity, _ = at(circle(heading="along"), np.linspace(0, 100, 41))
    np.testing.assert_allclose(position[:, 5], np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0])), atol=1e-12)
    np.testing.assert_array_equal(at(circle(), [1.0, 70.0])[0][:, 3:], 0)


def test_helix_after_one_turn():
    position, velocity, _ = at(helix(3.0, 20.0, 0.1, 1.5, "along"), [0.0, 5.0, 20.0])
    expected = [[0, 0, 1.5, 0, 0, 0], [3, 3, 2, 0, 0, np.pi / 2], [0, 0, 3.5, 0, 0, 2 * np.pi]]
    np.testing.assert_allclose(position, expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(velocity[:, :3], axis=1), np.hypot(2 * np.pi * 3 / 20, 0.1), rtol=1e-14)


def test_lissajous_closes():
    """Frequencies 1 : 2 : 3 meet after a whole turn of the first; a quarter of it in closed form."""
    amplitude = (2.0, 1.0, 0.5, 0.3)
    reference = lissajous(amplitude, (0.1, 0.2, 0.3, 0.1), (0, 0, np.pi / 2, np.pi / 2), 4.0)
    turn = 2 * np.pi / 0.1
    position, velocity, _ = at(reference, [0.0, turn / 4, turn])
    np.testing.assert_allclose(position[0], [0, 0, 4.5, 0, 0, 0.3], rtol=0, atol=1e-14)
    np.testing.assert_allclose(position[1], [2, 0, 4.0, 0, 0, 0], rtol=0, atol=1e-14)
    np.testing.assert_allclose(position[2], position[0], rtol=0, atol=1e-13)
    np.testing.assert_allclose(velocity[0], [0.2, 0.2, 0, 0, 0, 0], rtol=0, atol=1e-14)


def test_sine_in_closed_form():
    times = np.array([0.0, 1.0, 7.3])
    position, _, _ = at(CASES["sine"][0], times)
    np.testing.assert_allclose(position[:, 0], 1 + 2 * np.sin(0.4 * times + 0.3), rtol=1e-14)
    np.testing.assert_allclose(position[:, 1], -1 + 0.5 * np.sin(1.1 * times), rtol=1e-14)
    with pytest.raises(BadInput, match="`amplitude` must be one number, or 3 of them"):
        sine([1.0, 2.0], [1.0, 2.0, 3.0])


def test_line_has_its_speed_in_the_middle():
    goal, start = np.array([3.0, 4.0, 1.0]), np.array([0.0, 0.0, 1.0])
    end = 5.0 / 0.5 + 4.0
    position, velocity, _ = at(line(goal, 0.5, start, 4.0, "along"), [0.0, 4.0, end / 2, 10.0, end])
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=1), [0, 0.5, 0.5, 0.5, 0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(position[[0, 2, 4], :3], [start, (start + goal) / 2, goal], rtol=0, atol=1e-14)
    np.testing.assert_allclose(position[:, 5], np.arctan2(4, 3), rtol=1e-15)
    times = np.linspace(0, end, 1401)
    np.testing.assert_allclose(np.linalg.norm(at(line(goal, 0.5, start, 4.0), times)[2], axis=1).max(), 1.5 * 0.5 / 4)


@pytest.mark.parametrize(
    ("count", "north"), [(4, 0.0), *(pytest.param(count, 10.0, marks=pytest.mark.full) for count in (1, 3))]
)
def test_lawn_mower_covers_its_length(count, north):
    reference = lawn_mower(10.0, 2.0, count, 0.5, 4.0, 3.0)
    length = count * 10 + (count - 1) * np.pi
    end = length / 0.5 + 4
    times = np.linspace(0, end, 100001)
    position, velocity, _ = at(reference, times)
    np.testing.assert_allclose(position[-1], [north, 2 * (count - 1), 3, 0, 0, 0], rtol=0, atol=1e-12)
    speed = np.linalg.norm(velocity, axis=1)
    np.testing.assert_allclose(np.trapezoid(speed, times), length, rtol=1e-9)
    np.testing.assert_allclose(speed[(times > 4) & (times < end - 4)], 0.5, rtol=1e-12)
    reached = [position[:, 0].min(), position[:, 0].max(), position[:, 1].min()]
    np.testing.assert_allclose(reached, [-1.0 * (count > 2), 10.0 + (count > 1), 0], rtol=0, atol=1e-6)


def test_lawn_mower_looks_where_it_goes():
    """Exactly on the legs, nearly where an arc begins; what the acceleration jumps by."""
    reference = lawn_mower(10.0, 2.0, 3, 0.5, 4.0, heading="along")
    times = np.linspace(0.1, 30 / 0.5 + 2 * np.pi / 0.5 + 3.9, 20001)
    position, velocity, _ = at(reference, times)
    off = np.abs(position[:, 5] - np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0])))
    assert 4.0 < np.degrees(off.max()) < 5.0
    on_leg = (position[:, 0] > 0.5) & (position[:, 0] < 9.5)
    np.testing.assert_allclose(off[on_leg], 0, atol=1e-12)
    joint = 10 / 0.5 + 2
    _, _, acceleration = at(reference, [joint - 1e-6, joint + 1e-6])
    np.testing.assert_allclose((acceleration[1] - acceleration[0])[:3], [0, 2 * 0.5**2 / 2, 0], rtol=0, atol=1e-6)


def test_waypoints_are_visited_on_time():
    position, velocity, _ = at(waypoints(SQUARE, 0.5, "along"), SQUARE_TIMES)
    np.testing.assert_allclose(position[:, :3], SQUARE, rtol=0, atol=1e-13)
    np.testing.assert_allclose(position[:, 5], np.radians([0, 45, 135, 225, 270]), rtol=0, atol=1e-13)
    np.testing.assert_allclose(velocity[[0, -1]], 0, atol=1e-13)
    twice = at(waypoints(SQUARE, 1.0), SQUARE_TIMES / 2)
    np.testing.assert_allclose(twice[1][:, :3], 2 * velocity[:, :3], rtol=0, atol=1e-13)
    assert not twice[0][:, 3:].any()


def test_yaw_along_waypoints_is_continuous():
    """Three rounds of a square are three turns; straight down it keeps its yaw."""
    rounds = np.concatenate([SQUARE[:4] + [0, 0, k] for k in range(3)] + [[[0, 0, 3], [0, 0, 4], [0, 0, 5]]])
    reference = waypoints(rounds, 1.0, "along")
    yaw = np.asarray(reference.path[:, 6])
    np.testing.assert_allclose(yaw[[0, -3, -2, -1]], np.pi * np.array([0, 5.5, 5.5, 5.5]), rtol=1e-14)
    assert (np.abs(np.diff(yaw)) <= np.pi / 2 + 1e-12).all()


def test_recorded_replays_its_rows():
    position, velocity, _ = at(recorded(ROWS), ROWS[:, 0])
    np.testing.assert_allclose(position, ROWS[:, 1:], rtol=0, atol=1e-14)
    np.testing.assert_allclose(velocity[[0, -1]], 0, atol=1e-14)


def test_recorded_comes_from_a_file(tmp_path):
    text = "t,d1,d2\n0,1,2\n1,3,-1\n4,0,0.5\n"
    (tmp_path / "x.csv").write_text(text)
    part, resolved = factory.make("references", {"kind": "recorded", "file": "x.csv"}, tmp_path)
    np.testing.assert_allclose(at(part, [1.0, 9.0])[0], [[3, -1], [0, 0.5]], rtol=0, atol=1e-14)
    assert resolved == {"kind": "recorded", "csv": text}


BAD = {
    "settling": (lambda: setpoint([1.0], -1.0), "`settling` must be zero or positive, but is -1 s"),
    "start": (
        lambda: setpoint([1.0, 2.0], 1.0, [0.0]),
        "`start` must have shape (2,), as `position` has, but is of shape (1,)",
    ),
    "circle": (lambda: circle(heading="ahead"), "`heading` must be one of fixed, along, but is ahead"),
    "radius": (lambda: helix(radius=0.0), "`radius` must be positive, but is 0 m"),
    "sink rate": (lambda: helix(sink_rate=np.nan), "`sink_rate` must be a finite number, but is nan m/s"),
    "amplitude": (
        lambda: lissajous((1, 2, 3)),
        "`amplitude` must have 4 entries (north, east, down, yaw), but is 3 long",
    ),
    "phase": (lambda: lissajous(phase=(0, 0, np.inf, 0)), "`phase[2]` must be a finite number, but is inf"),
    "goal": (lambda: line((1, 2)), "`goal` must have 3 entries (north, east, down), but is 2 long"),
    "no way": (lambda: line((1, 2, 3), start=(1, 2, 3)), "`goal` must differ from `start`, but is the same"),
    "vertical": (
        lambda: line((0, 0, 3), heading="along"),
        "`heading` must be fixed when the line is vertical, but is along",
    ),
    "ramp": (lambda: line(ramp=0.0), "`ramp` must be positive, but is 0 s"),
    "legs": (lambda: lawn_mower(count=0), "`count` must be a whole number above zero, but is 0"),
    "spacing": (lambda: lawn_mower(spacing=-1.0), "`spacing` must be positive, but is -1 m"),
    "one row": (
        lambda: recorded([[0.0, 1.0]]),
        "`samples` must have two or more rows (t, p1, p2, ...), but is of shape (1, 2)",
    ),
    "times": (
        lambda: recorded([[0.0, 1], [1, 1], [1, 2]]),
        "`samples` must have increasing times, but is row 3 too early",
    ),
    "points": (
        lambda: waypoints([[0.0, 1], [1, 1]]),
        "`points` must have two or more rows (north, east, down), but is of shape (2, 2)",
    ),
    "repetition": (
        lambda: waypoints([[0.0, 1, 2], [0, 1, 2]]),
        "`points` must differ from row to row, but is row 2 a repetition",
    ),
    "speed": (lambda: waypoints(SQUARE, 0.0), "`speed` must be positive, but is 0 m/s"),
    "down": (
        lambda: waypoints([[0, 0, 1], [0, 0, 2.0]], 1.0, "along"),
        "`heading` must be fixed when the way is vertical, but is along",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input(name):
    make, said = BAD[name]
    with pytest.raises(BadInput) as error:
        make()
    assert named(str(error.value)) == named(said)
