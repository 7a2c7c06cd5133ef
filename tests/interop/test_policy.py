"""A policy as a controller: a PD law written as one, a network of a file, environments, comparisons, and mistakes."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.cli.main import run
from undertow.core.errors import BadInput
from undertow.outside import gymnasium as ug

pytestmark = pytest.mark.interop

PENDULUM = {
    "plant": {"kind": "inverted_pendulum", "limit": 30.0},
    "reference": {"kind": "sine", "amplitude": 0.1, "frequency": 1},
    "initial": {"position": [0.05]},
    "loop": {"duration": 1.0, "dt": 0.001, "record": 0.001},
}
PD = """
def act(seen):
    error, rate, before = seen
    return (400.0 * error + 40.0 * rate)[None]
"""
LAW = """
import equinox as eqx
from undertow.core.contracts import AbstractController, Model

class PD(AbstractController):
    model: Model
    def init(self, y, r): return ()
    def command(self, z, y, r):
        error = self.model.coordinates.tracking_error(y, r)
        return 400.0 * error.error + 40.0 * error.rate, {}
    def advance(self, z, y, r, u_applied, dt): return z
    def signals(self): return {}

def pd(model): return PD(model)
"""
ACTION = {"kind": "policy", "action": "input"}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "my_policy.py").write_text(PD)
    (tmp_path / "pd.py").write_text(LAW)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def layers(*sizes, seed=0):
    rng = np.random.default_rng(seed)
    arrays = {}
    for number, (entries, outs) in enumerate(itertools.pairwise(sizes)):
        arrays |= {f"weight_{number}": rng.normal(size=(outs, entries)), f"bias_{number}": 0.1 * rng.normal(size=outs)}
    return arrays


def test_a_pd_law_as_a_policy_is_the_pd_law(folder):
    law = ut.simulate_scenario(PENDULUM | {"controller": "./pd.py:pd"}).dataset
    policy = ut.simulate_scenario(PENDULUM | {"controller": ACTION | {"function": "./my_policy.py:act"}}).dataset
    assert np.abs(law.error.values[-1]).max() < 0.05 and policy.attrs["status"] == "completed"
    np.testing.assert_allclose(policy.position.values, law.position.values, rtol=0, atol=1e-12)
    np.testing.assert_allclose(policy["input"].values, np.clip(policy.action.values, -30, 30), rtol=0, atol=1e-12)


@pytest.mark.parametrize("action", ["normalised", "input"])
def test_an_environment_under_the_same_function_is_the_same_run(folder, action):
    """To rounding: the function is computed by JAX here and by the batch compiler there."""
    np.savez(folder / "net.npz", **layers(3, 8, 1))
    arrays = layers(3, 8, 1)
    scenario = PENDULUM | {"loop": PENDULUM["loop"] | {"duration": 0.12}}
    given = {"kind": "policy", "function": "./net.npz", "action": action}
    record = ut.simulate_scenario(scenario | {"controller": given}).dataset
    env = ug.make(scenario, action=action)
    seen, info = env.reset(seed=0)
    for k in range(120):
        np.testing.assert_allclose(info["position"], record.position.values[k], rtol=0, atol=1e-12)
        hidden = np.tanh(arrays["weight_0"] @ seen + arrays["bias_0"])
        own = arrays["weight_1"] @ hidden + arrays["bias_1"]
        seen, *_, info = env.step(np.clip(own, *env.interface.action_bounds()))
    assert np.ptp(record.action.values) > 0.01


def test_compare_takes_a_policy(folder, capsys):
    (folder / "scenario.yaml").write_text(
        "plant: {kind: inverted_pendulum, limit: 30.0}\n"
        "controller: {kind: policy, function: ./my_policy.py:act, action: input}\n"
        "reference: {kind: setpoint, position: [0.1]}\n"
        "navigation: {kind: white_noise, position: 0.001}\n"
        "loop: {duration: 1.0, dt: 0.001}\n"
    )
    assert run(["compare", "scenario.yaml", "--controllers", "scenario,./pd.py:pd", "--trials", "3"]) == 0
    assert "scenario" in capsys.readouterr().out


def test_the_file_is_found_from_the_scenario(folder, monkeypatch, tmp_path_factory):
    path = folder / "scenario.yaml"
    path.write_text(
        "plant: {kind: inverted_pendulum, limit: 30.0}\n"
        "controller: {kind: policy, function: ./my_policy.py:act, action: input}\n"
        "reference: {kind: setpoint, position: [0.1]}\n"
        "loop: {duration: 0.1, dt: 0.001}\n"
    )
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    dataset = ut.simulate_scenario(path).dataset
    assert str(folder / "my_policy.py") in dataset.attrs["code"]
    dataset.to_netcdf("run.nc")
    with pytest.raises(BadInput, match="not name Python code"):
        ut.simulate_scenario("run.nc")
    assert ut.simulate_scenario("run.nc", allow_code=True).dataset.equals(dataset)


def model():
    return ut.plants.inverted_pendulum(limit=30.0).model()


def test_a_network_in_float32(folder):
    np.savez(folder / "net.npz", **layers(3, 4, 1))
    scenario = PENDULUM | {"controller": {"kind": "policy", "function": "./net.npz"}, "precision": "float32"}
    assert ut.simulate_scenario(scenario | {"loop": PENDULUM["loop"] | {"duration": 0.05}}).status == 0


@pytest.mark.parametrize(
    "arrays, said",
    [
        ({}, "hold weight_0, bias_0"),
        ({"weight_0": np.zeros((1, 3))}, "hold weight_0, bias_0"),
        ({"weight_0": np.zeros((1, 3)), "bias_0": np.zeros(2)}, r"that fit, but is of shapes \(1, 3\) and \(2,\)"),
        ({"weight_0": np.zeros(3), "bias_0": np.zeros(1)}, "that fit"),
        ({"weight_0": np.full((1, 3), np.nan), "bias_0": np.zeros(1)}, "hold finite numbers"),
        ({"weight_0": np.array([["a"]]), "bias_0": np.zeros(1)}, "hold finite numbers"),
        ({"weight_0": np.zeros((1, 9)), "bias_0": np.zeros(1)}, "take an observation of 3 entries"),
        ({"weight_0": np.zeros((2, 3)), "bias_0": np.zeros(2)}, r"give an action of shape \(1,\)"),
    ],
)
def test_networks_that_do_not_fit(tmp_path, arrays, said):
    np.savez(tmp_path / "net.npz", **arrays)
    with pytest.raises(BadInput, match=said):
        ut.controllers.policy(model(), str(tmp_path / "net.npz"))


def test_damaged_files_are_one_line(tmp_path):
    """Random changes of a file: the network as it was, another one, or `BadInput`, and nothing else."""
    path, rng = tmp_path / "net.npz", np.random.default_rng(0)
    np.savez(path, **layers(3, 4, 1))
    whole, refused = path.read_bytes(), 0
    for trial in range(300):
        changed = bytearray(whole)
        for place in rng.integers(len(whole), size=1 + trial % 4):
            changed[place] = rng.integers(256)
        path.write_bytes(bytes(changed[: rng.integers(len(whole))] if trial % 5 == 0 else changed))
        try:
            ut.controllers.policy(model(), str(path))
        except BadInput as error:
            refused += "\n" not in str(error)
    assert refused > 150


@pytest.mark.parametrize(
    "function, said",
    [
        ("net.txt", r"`function` must be ./file.py:function, or an .npz file"),
        ("missing.npz", r"`function` must be an .npz file of numbers"),
        ("missing.py:act", "`function` must name an existing file"),
        ("my_policy.py:move", "`function` must name a function in my_policy.py"),
    ],
)
def test_functions_that_are_not_there(folder, function, said):
    with pytest.raises(BadInput, match=said):
        ut.controllers.policy(model(), function)


def test_a_function_of_the_users_with_a_mistake(folder):
    (folder / "wrong.py").write_text("def act(seen):\n    return seen @ seen[:2]\n")
    with pytest.raises(BadInput, match=r"controller.*`act`.*wrong.py, line 2"):
        ut.simulate_scenario(PENDULUM | {"controller": {"kind": "policy", "function": "./wrong.py:act"}})
    with jax.enable_x64(True):
        interface = ut.controllers.policy(model(), "my_policy.py:act", action="input").interface
        np.testing.assert_array_equal(interface.within_bounds(jnp.array([99.0])), [30.0])
