"""Environments of Gymnasium: its own checker, the bits of simulations, many as one, and what is given wrongly."""

import warnings

import gymnasium
import jax
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import undertow as ut
from undertow.core.errors import BadInput
from undertow.outside import gymnasium as ug

pytestmark = pytest.mark.interop

SHORT = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "rcaf", "preset": "robust"},
    "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5], "settling": 5},
    "disturbance": {"kind": "random_suite"},
    "navigation": {"kind": "white_noise", "position": 0.001, "velocity": 0.01},
    "loop": {"duration": 0.5, "dt": 0.01, "record": 0.01},
    "seed": 7,
}
SEA = SHORT | {
    "disturbance": [{"kind": "current", "velocity": [0.3, 0.2, 0]}, {"kind": "waves", "height": 0.5, "depth": 3.0}],
    "navigation": {"kind": "observer"},
}
PENDULUM = {
    "plant": {"kind": "inverted_pendulum", "limit": 30.0},
    "controller": "paper",
    "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1},
    "initial": {"position": [0.05]},
    "loop": {"duration": 0.2, "dt": 0.001, "record": 0.001},
}


@pytest.fixture(scope="module")
def env():
    return ug.make(SHORT)


@pytest.fixture(scope="module")
def pendulum():
    return ug.make(PENDULUM)


def test_gymnasiums_checker_has_nothing_to_say(env, pendulum):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for one in (env, pendulum, ug.make(PENDULUM | {"precision": "float32"})):
            check_env(one, skip_render_check=True)


@pytest.mark.parametrize(
    "scenario, action",
    [(SHORT, "normalised"), (SHORT, "input"), pytest.param(SEA, "input", marks=pytest.mark.slow), (PENDULUM, "input")],
    ids=["shares", "volts", "sea", "newtons"],
)
def test_the_laws_commands_give_the_run_of_a_simulation(scenario, action):
    """Bit for bit; normalised too, because 16 V is a power of two."""
    record = ut.simulate_scenario(scenario).dataset
    env = ug.make(scenario, action=action)
    commands = record["commanded_input"].values
    if action == "normalised":
        commands = commands / np.asarray(env.interface.high)
    observation, info = env.reset(seed=scenario.get("seed", 0))
    n = record.position.shape[1]
    angles = np.array(env.interface.coordinates.angles)
    for k in range(len(commands) - 1):
        np.testing.assert_array_equal(info["position"], record.position.values[k])
        raw = record.reference.values[k] - record.measured_position.values[k]
        np.testing.assert_allclose(observation[:n], raw - 2 * np.pi * angles * np.round(raw / (2 * np.pi)), atol=1e-15)
        observation, _, terminated, truncated, info = env.step(commands[k])
        assert not terminated and truncated == (k == len(commands) - 2)
    np.testing.assert_array_equal(info["position"], record.position.values[-1])


def test_a_vector_environment_is_its_environments_one_by_one():
    """Random actions and several episodes, seeds of their own, autoreset on the next step."""
    count, rng = 5, np.random.default_rng(0)
    options = {"vary": {"plant.vehicle.mass": {"uniform": [12.0, 15.0]}}, "variants": 3}
    scenario = SHORT | {"loop": SHORT["loop"] | {"duration": 0.1}}
    vector, alone = ug.make_vec(scenario, count, **options), [ug.make(scenario, **options) for _ in range(count)]
    seen, info = vector.reset(seed=3)
    over = [False] * count
    for i, env in enumerate(alone):
        observation, own = env.reset(seed=3 + i)
        np.testing.assert_array_equal(seen[i], observation)
        assert info["seed"][i] == own["seed"] == 3 + i
    assert len({tuple(row) for row in seen}) == count
    for _ in range(25):
        actions = rng.uniform(-1, 1, size=(count, 8))
        seen, reward, terminated, truncated, info = vector.step(actions)
        for i, env in enumerate(alone):
            if over[i]:
                observation, own = env.reset()
                found = observation, 0.0, False, False
            else:
                *found, own = env.step(actions[i])
            np.testing.assert_array_equal(seen[i], found[0])
            assert (reward[i], terminated[i], truncated[i]) == tuple(found[1:])
            np.testing.assert_array_equal(info["position"][i], own["position"])
            over[i] = found[2] or found[3]


def test_the_reward_is_the_cost_as_documented(env):
    rng = np.random.default_rng(1)
    weighted = ug.make(SHORT, cost={"position": 0.5, "angle": 0.2, "effort": 0.3, "variation": 0.7})
    weighted.reset(seed=0)
    before = np.zeros(8)
    for _ in range(5):
        action = rng.uniform(-1, 1, 8)
        _, reward, _, _, info = weighted.step(action)
        error = info["error"]
        cost = (error[:3] ** 2).sum() / 0.25 + (error[3:] ** 2).sum() / 0.04
        cost += 0.3 * (action**2).mean() + 0.7 * ((action - before) ** 2).mean()
        assert reward == pytest.approx(-cost, rel=1e-12)
        before = action


def test_an_episode_that_fails_is_terminated():
    """A pendulum that is pushed over; the cost of failure is paid once, and the state stays finite."""
    env = ug.make(PENDULUM | {"loop": PENDULUM["loop"] | {"duration": 5.0}}, cost={"failure": 1000.0})
    env.reset(seed=0)
    rewards, terminated = [], False
    while not terminated:
        observation, reward, terminated, truncated, info = env.step(np.ones(1))
        rewards.append(reward)
        assert not truncated and np.isfinite(observation).all()
    assert info["status"] == "out_of_range" and rewards[-1] < -1000 < rewards[-2]
    with pytest.raises(BadInput, match="`reset` must be called before `step`"):
        env.step(np.ones(1))


def test_a_wrench_goes_where_it_says():
    """Steady thrust of an action along one axis accelerates a vehicle along that axis by that share, and no other."""
    scenario = SHORT | {"loop": SHORT["loop"] | {"duration": 0.02}}
    env = ug.make(scenario, action="wrench")
    assert env.action_space.shape == (6,) and env.observation_space.shape == (28,)
    env.reset(seed=0)
    observation, *_ = env.step(np.full(6, 0.1))
    np.testing.assert_array_equal(observation[22:], 0.1)
    with jax.enable_x64(True):
        vehicle = ut.vehicles.bluerov2_heavy()
        inverse_mass, matrix = np.linalg.inv(vehicle.mass_matrix()), np.asarray(vehicle.thruster_matrix())
        effect, motor = inverse_mass @ matrix, ut.thrusters.t200(supply=16).motor
        strongest = min(
            float(motor.thrust(speed)) * sign
            for speed, sign in ((motor.steady_speed(16.0), 1), (motor.steady_speed(-16.0), -1))
        )
        largest = np.abs(effect).sum(axis=1) * strongest
        for axis in range(6):
            action = 0.2 * np.eye(6)[axis]
            volts = env.interface.command(jax.numpy.asarray(action))
            thrust = np.array([float(motor.thrust(motor.steady_speed(one))) for one in volts])
            np.testing.assert_allclose(effect @ thrust, action * largest, rtol=1e-6, atol=1e-6)


def test_the_seed_decides(env):
    first, _ = env.reset(seed=1)
    env.action_space.seed(0)
    second, info = env.reset()
    again, _ = env.reset(seed=1)
    np.testing.assert_array_equal(first, again)
    assert (first != second).any()
    np.testing.assert_array_equal(env.reset()[0], second)
    np.testing.assert_array_equal(env.reset(seed=info["seed"])[0], second)


def test_some_environments_are_reset():
    vector = ug.make_vec(PENDULUM, 4)
    vector.reset(seed=0)
    for _ in range(3):
        seen, *_ = vector.step(np.full((4, 1), 0.3))
    mask = np.array([False, True, False, True])
    again, info = vector.reset(seed=9, options={"reset_mask": mask})
    np.testing.assert_array_equal(again[~mask], seen[~mask])
    np.testing.assert_array_equal(again[mask], ug.make_vec(PENDULUM, 4).reset(seed=9)[0][mask])
    np.testing.assert_array_equal(info["_seed"], mask)


def test_registered_names():
    env = gymnasium.make("undertow/Scenario-v0", scenario=PENDULUM)
    assert env.reset(seed=0)[0].shape == (3,)
    vector = gymnasium.make_vec("undertow/Scenario-v0", num_envs=3, scenario=PENDULUM)
    assert vector.reset(seed=0)[0].shape == (3, 3)
    assert "undertow/BlueROV2Heavy-v0" in gymnasium.registry


def test_by_xla_where_the_batch_compiler_cannot(monkeypatch):
    """The same to rounding."""
    from undertow.simulation.loop import stepped_batch

    def unsupported(*_):
        raise stepped_batch.Unsupported("for a test")

    expected = ug.make_vec(PENDULUM, 3)
    monkeypatch.setattr(stepped_batch, "starter", unsupported)
    monkeypatch.setattr(stepped_batch, "kept_steps", unsupported)
    vector = ug.make_vec(PENDULUM, 3, vary={"plant.cart_mass": {"uniform": [0.9, 1.1]}}, variants=2)
    assert expected._episodes.backend == "simd" and vector._episodes.backend == "xla"
    same = ug.make_vec(PENDULUM, 3)
    assert same._episodes.backend == "xla"
    np.testing.assert_allclose(same.reset(seed=0)[0], expected.reset(seed=0)[0], rtol=1e-12, atol=1e-12)
    vector.reset(seed=0)
    for k in range(210):
        action = np.full((3, 1), 0.1 * np.sin(k))
        for found, wanted in zip(same.step(action)[:4], expected.step(action)[:4], strict=True):
            np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)
    heavier = vector.step(action)[0]
    assert (heavier[0] != heavier[1]).any()
    np.testing.assert_array_equal(heavier[0], heavier[2])


@pytest.mark.parametrize(
    "options, said",
    [
        ({"action": "volts"}, "`action` must be one of normalised, input, wrench, but is volts"),
        ({"action": "wrench"}, "`action` must be normalised or input for a plant without body axes"),
        ({"scale": -1.0}, "`scale` must be positive"),
        ({"cost": {"position": 0.0}}, r"`cost.position` must be positive"),
        ({"cost": {"speed": 1.0}}, "`cost` must have the keys position, angle"),
        ({"render_mode": "human"}, "`render_mode` must be None"),
        ({"vary": {"plant.cart_mass": {"uniform": [2, 1]}}}, "must have low below high"),
        ({"vary": {"plant.wheels": {"uniform": [1, 2]}}}, "wheels"),
    ],
)
def test_what_an_environment_cannot_be_made_of(options, said):
    with pytest.raises(BadInput, match=said):
        ug.make(PENDULUM, **options)


def test_what_is_given_wrongly(env):
    env.reset(seed=0)
    for action, said in (
        (np.zeros(7), r"`action` must have shape \(8,\)"),
        (np.full(8, np.nan), "`action` must be finite"),
        ("up", "`action` must be numbers"),
    ):
        with pytest.raises(BadInput, match=said):
            env.step(action)
    with pytest.raises(BadInput, match="`num_envs` must be a positive integer"):
        ug.make_vec(PENDULUM, 0)
    with pytest.raises(BadInput, match=r"`loop.kind` must be sampled for an environment"):
        ug.make(PENDULUM | {"loop": {"kind": "continuous"}})
    vector = ug.make_vec(PENDULUM, 2)
    with pytest.raises(BadInput, match="`reset` must be called before `step`"):
        vector.step(np.zeros((2, 1)))
    with pytest.raises(BadInput, match="`seed` must be one, or 2 of them"):
        vector.reset(seed=[1, 2, 3])
    with pytest.raises(BadInput, match="`reset_mask` must be 2 booleans"):
        vector.reset(options={"reset_mask": np.ones(3)})
