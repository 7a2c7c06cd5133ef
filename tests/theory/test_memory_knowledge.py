"""What was learnt has names, survives a file, and enters the bound of the estimation error."""

import tracemalloc

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr

from undertow.analysis.certificate.function import estimation_bound, fastest_uncertainty
from undertow.analysis.theory import SteadyWindow, theory_of
from undertow.control.controllers import rcaf
from undertow.control.controllers.robust.knowledge import load_knowledge, regressor_names, save_knowledge, strongest
from undertow.control.controllers.robust.memory import memory
from undertow.control.navigation import perfect
from undertow.control.references import sine
from undertow.core.contracts import TrackingError
from undertow.core.errors import BadInput
from undertow.physics.disturbances import sinusoid
from undertow.physics.plants import double_integrator, hybrid_vehicle
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.report.run_tables import memory_rows
from undertow.simulation.loop import simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.dataset import to_dataset

DT = 0.02
OPTIONS = {"sampling_time": DT, "bandwidth": 4.0, "tracking": 2.0}


@pytest.mark.parametrize("regressor", ["both", "rules", "linear"])
def test_every_entry_of_the_regressor_has_its_name(regressor):
    """Velocities and accelerations at which each named entry has a known value."""
    model = hybrid_vehicle(bluerov2_heavy(), t200()).model().in_body_axes()
    axes, part = model.coordinates.axes, memory(6, regressor=regressor, speeds=0.5)
    names = regressor_names(axes, 5, regressor, body=True)
    assert len(names) == len(set(names)) == part.size(6, True)
    roll, pitch = 0.4, -0.3
    velocity, acceleration = jnp.asarray([0.25, -0.1, 0.0, 0.0, 0.3, 0.0]), jnp.asarray([0.0, 0.0, 0.7, 0.0, 0.0, 0.0])

    @jax.jit
    def phi_of(attitude, turn):
        y = model.coordinates.measurement(jnp.concatenate([jnp.zeros(3), attitude]), jnp.zeros(6))
        off = TrackingError(jnp.concatenate([jnp.zeros(3), turn]), jnp.zeros(6), acceleration)
        return part.regressors(y, velocity, off, True)

    turn = np.array([0.1, -0.2, 0.05])
    found = dict(zip(names, np.asarray(phi_of(jnp.asarray([roll, pitch, 0.9]), jnp.asarray(turn))), strict=True))
    u, v, w, p, q, r = axes
    down = np.array([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
    gravity = down + np.cross(down, turn) - [0.0, 0.0, 1.0]
    expected = {f"gravity along {axis}": part for axis, part in zip((u, v, w), gravity, strict=True)}
    # Shares of 0.5 of v and q, and of others nothing: products are u v, v w, w u; p v, q w, r u; p w, q u, r v.
    share = dict(zip(axes, np.asarray(velocity) / 0.5, strict=True))
    pairs = (u, v), (v, w), (w, u), (p, v), (q, w), (r, u), (p, w), (q, u), (r, v)
    expected |= {f"{one} {other}": share[one] * share[other] for one, other in pairs}
    expected |= {"1": 1.0, f"acceleration of {w}": 0.7}
    if regressor != "rules":
        expected |= {u: 0.5, f"{u} |{u}|": 0.25, v: -0.2, f"{v} |{v}|": -0.04, r: 0.0}
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, atol=1e-12, err_msg=name)
    if regressor != "linear":
        still, at_half = jax.jit(lambda share: part.fuzzy.basis(share))(np.array([[0.0], [0.5]]))
        np.testing.assert_allclose(found[f"rule of {u} at +0.5 of its range"], at_half[3] - still[3])
        assert found[f"rule of {u} at +0.5 of its range"] > 0.2
        assert found[f"rule of {w} at -1 of its range"] == 0.0


def damage(kind, path):
    """Write a file that holds no knowledge."""
    good = {"weights": np.zeros((3, 1)), "variance": np.ones(3)}
    np.savez(path, **good)
    whole = path.read_bytes()
    if kind == "text":
        path.write_text("weights: 3\n", encoding="utf-8")
    elif kind == "empty":
        path.write_bytes(b"")
    elif kind == "cut":
        path.write_bytes(whole[: len(whole) // 2])
    elif kind == "flipped":
        path.write_bytes(whole[:120] + bytes(b ^ 0xFF for b in whole[120:200]) + whole[200:])
    elif kind == "array":
        with path.open("wb") as file:
            np.save(file, np.zeros(3))
    elif kind == "objects":
        np.savez(path, weights=np.array([None, {}]), variance=np.ones(2))
    else:
        np.savez(path, **(good | kind))


@pytest.mark.parametrize(
    "kind",
    [
        "text",
        "empty",
        "cut",
        "flipped",
        "array",
        "objects",
        {"variance": np.ones(2)},
        {"weights": np.zeros(3)},
        {"weights": np.full((3, 1), np.nan)},
        {"variance": np.full(3, -0.1)},
        {"variance": np.full(3, 2.0)},
        {"inertia": np.ones(2)},
        {"inertia": np.zeros(1)},
        {"inertia": np.full(1, np.inf)},
        {"weights": np.full((3, 1), 1j)},
        {"more": np.zeros(2_500_000)},
    ],
    ids=str,
)
def test_a_damaged_file_is_refused_in_one_line(kind, tmp_path):
    damage(kind, tmp_path / "learnt.npz")
    with pytest.raises(BadInput, match="knowledge") as caught:
        load_knowledge(tmp_path / "learnt.npz")
    assert "\n" not in str(caught.value)


def test_no_flipped_bit_is_more_than_a_damaged_file(tmp_path):
    """Or than nothing: the numbers of a file are under a checksum."""
    path, good, chance = tmp_path / "learnt.npz", tmp_path / "good.npz", np.random.default_rng(4)
    damage({}, good)
    whole, expected, refused = good.read_bytes(), load_knowledge(good), 0
    for _ in range(300):
        data = bytearray(whole)
        data[chance.integers(len(data))] ^= 1 << int(chance.integers(8))
        path.write_bytes(data)
        try:
            found = load_knowledge(path)
        except BadInput:
            refused += 1
            continue
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(one, other)
    assert refused > 100


def test_knowledge_of_an_earlier_dive_stays_where_the_disk_is_full(tmp_path, monkeypatch):
    path = tmp_path / "learnt.npz"
    damage({}, path)
    before = path.read_bytes()

    def full(file, **arrays):
        file.write_bytes(b"half")
        raise OSError("No space left on device")

    monkeypatch.setattr(np, "savez", full)
    run = {"memory_weights": xr.DataArray(np.zeros((1, 3, 1))), "memory_variance": xr.DataArray(np.ones((1, 3)))}
    with pytest.raises(OSError, match="No space"):
        save_knowledge(path, run)
    assert path.read_bytes() == before and [one.name for one in tmp_path.iterdir()] == ["learnt.npz"]


def test_weights_of_a_file_beyond_the_bound_are_projected_onto_it(tmp_path):
    plant = double_integrator(1)
    count = memory(1).size(1, False)
    np.savez(tmp_path / "large.npz", weights=np.full((count, 1), 9.0), variance=np.ones(count))
    law = rcaf(plant.model(), preset="learning", memory_bound=2.0, knowledge=str(tmp_path / "large.npz"), **OPTIONS)
    np.testing.assert_array_equal(law.memory.init(1, False).weights, 2.0)


@pytest.fixture(scope="module")
def dives(tmp_path_factory):
    """Runs with a load that repeats with the reference: without a memory, with one, and with one of the wrong sign."""
    plant, file = double_integrator(1), tmp_path_factory.mktemp("knowledge") / "turned.npz"
    found = {}
    for name in ("robust", "learning", "turned"):
        more = {"preset": "robust" if name == "robust" else "learning"}
        if name == "turned":
            _, learnt = found["learning"]
            np.savez(file, weights=-learnt["memory_weights"].values[-1], variance=learnt["memory_variance"].values[-1])
            more["knowledge"] = str(file)
        law = rcaf(plant.model(), **more, **OPTIONS)
        loop = ClosedLoop(plant, law, sine(0.5, 1.0), sinusoid(0.8, 1.0, phase=0.3), perfect())
        run = simd_batch.simulate(loop, duration=80.0, dt=DT, record_every=1)
        found[name] = law, to_dataset(run, loop)
    return found


def test_bad_options_of_the_memory_are_refused(tmp_path):
    model, wrong = double_integrator(1).model(), tmp_path / "wrong.npz"
    np.savez(wrong, weights=np.zeros((3, 1)), variance=np.ones(3))
    made = lambda **options: rcaf(model, preset="learning", **options)
    for name, value in {"rules": 4, "regressor": "cubic", "horizon": 0.0, "learning_rate": -1.0, "speeds": 0.0}.items():
        with pytest.raises(BadInput, match=name):
            made(**{name: value})
    with pytest.raises(BadInput, match="knowledge"):
        made(knowledge=str(tmp_path / "missing.npz"))
    with pytest.raises(BadInput, match="knowledge"):
        made(knowledge=str(wrong))


def test_bad_probing_is_refused():
    model = hybrid_vehicle(bluerov2_heavy(), t200()).model(rate_term=True)
    for value in (-0.1, float("nan"), [0.1, 0.1]):
        with pytest.raises(BadInput, match="probing"):
            rcaf(model, preset="learning", sampling_time=DT, probing=value)
    law = rcaf(model, preset="learning", sampling_time=DT, probing=0.0)
    assert law.memory.inertia is None
    assert "inertia" not in law.signals()


def test_the_strongest_weights_of_each_axis_are_listed():
    weights, variance = np.array([[0.1, -3.0], [-2.0, 0.5], [1.0, 1.0]]), np.array([0.04, 0.09, 0.16])
    found = strongest(weights, variance, ["a", "b", "c"], ["x", "y"], count=2)
    assert [(one.axis, one.regressor, one.weight) for one in found] == [
        ("x", "b", -2.0), ("x", "c", 1.0), ("y", "a", -3.0), ("y", "c", 1.0)
    ]  # fmt: skip
    assert [one.variance for one in found] == [0.09, 0.16, 0.04, 0.16]


@pytest.mark.full
@pytest.mark.parametrize("name", ["robust", "learning", "turned"])
def test_the_estimation_error_is_within_the_bound_of_what_the_memory_does_not_explain(dives, name):
    """The bound is an L1 norm: it holds for any weights, right or wrong, once the start is forgotten."""
    law, run = dives[name]
    late = run.isel(time=run["time"].values > 6.0)
    error = np.abs(late["estimate"].values - late["uncertainty"].values)
    allowed = estimation_bound(law.estimator, DT, fastest_uncertainty(late))
    assert (error <= allowed + 1e-9).all()
    assert error.max() > 0.2 * allowed.max()


@pytest.mark.full
def test_what_is_learnt_makes_the_bound_small(dives):
    late = {name: run.isel(time=run["time"].values > 60.0) for name, (_, run) in dives.items()}
    rates = {name: fastest_uncertainty(run)[0] for name, run in late.items()}
    np.testing.assert_allclose(rates["robust"], 0.8, rtol=0.02)  # amplitude times frequency of the load
    assert rates["learning"] < 0.25 * rates["robust"]


@pytest.mark.full
def test_the_run_says_what_was_learnt(dives):
    law, run = dives["learning"]
    found = theory_of(law).certificate(run, run, SteadyWindow(40.0, 80.0), DT).numbers
    table = memory_rows(found)
    weights, variance = (run[f"memory_{name}"].values[-1] for name in ("weights", "variance"))
    largest = np.abs(weights[:, 0]).argmax()
    assert len(table.rows) == 3
    assert table.rows[0][2] == weights[largest, 0]
    names = regressor_names(["x"], 5, "both", body=False)
    assert strongest(weights, variance, names, ["x"])[0].regressor == names[largest]
    assert found["memory_trust"] == run["memory_trust"].values.min(0).tolist()


def test_a_small_file_of_many_bytes(tmp_path):
    """Whole numbers of a byte each would take eight times their size, twice, before anything is found wrong."""
    ones = np.ones((1000, 15_000), dtype=np.uint8)
    np.savez_compressed(tmp_path / "large.npz", weights=ones, variance=np.ones(1000, dtype=np.uint8))
    assert (tmp_path / "large.npz").stat().st_size < 50_000
    tracemalloc.start()
    with pytest.raises(BadInput, match="be a file of `save_knowledge`"):
        load_knowledge(tmp_path / "large.npz")
    assert tracemalloc.get_traced_memory()[1] < 5e7
    tracemalloc.stop()
