"""Parts from a file of the user's own: `./my_rov.py:my_rov`."""

import pytest
from good_scenario import SCENARIO, SMALL
from messages import named

GOOD = """
import undertow as ut


def my_rov(mass: float = 130.0):
    import equinox as eqx

    return eqx.tree_at(lambda rov: rov.mass, ut.vehicles.odin(), mass)
"""


def scenario(tmp_path, part="./my_rov.py:my_rov", code=GOOD):
    (tmp_path / "my_rov.py").write_text(code)
    (tmp_path / "s.yaml").write_text(SCENARIO.replace("kind: odin, mass: 125", f"kind: {part}"))


@pytest.mark.full
def test_part_from_a_file_runs(undertow, tmp_path):
    scenario(tmp_path)
    plant = "{vehicle: ./my_rov.py:my_rov, thruster: {kind: paper_table3, fidelity: ideal}, ledger: false}"
    one_axis = "{kind: double_integrator, axes: 1, limit: 20}"
    (tmp_path / "s.yaml").write_text(SMALL.replace(one_axis, plant).replace("[1]", "[1, 0, 0, 0, 0, 0]"))
    said = undertow("simulate", "s.yaml", "--out", "out")
    assert said.code == 0, said.err
    assert f"{tmp_path / 'my_rov.py'}:my_rov" in (tmp_path / "out" / "scenario.yaml").read_text()


@pytest.mark.parametrize(
    ("part", "code", "said"),
    [
        ("./his_rov.py:my_rov", GOOD, "`plant.vehicle.kind` must name an existing file, but is ./his_rov.py"),
        ("./my_rov.py:my_rv", GOOD, "`plant.vehicle.kind` must name a function in my_rov.py, but is my_rv"),
        (
            "./my_rov.py:my_rov",
            "1 / 0",
            "`plant.vehicle.kind`: Python cannot run it: ZeroDivisionError: division by zero (my_rov.py, line 1)",
        ),
        ("./my_rov.py:my_rov", "def my_rov(:", "`plant.vehicle.kind`: Python cannot run it: SyntaxError"),
        (
            "./my_rov.py:my_rov",
            "def my_rov():\n    return 1 / 0",
            "`plant.vehicle`: cannot run `my_rov`: ZeroDivisionError: division by zero (my_rov.py, line 2)",
        ),
        (
            "./my_rov.py:my_rov",
            "def my_rov():\n    return 7",
            "`plant.vehicle.kind` must name a function that returns a VehicleModel, but is ./my_rov.py:my_rov, which returns 7",
        ),
    ],
)
def test_part_that_does_not_work(refused, tmp_path, part, code, said):
    scenario(tmp_path, part, code)
    complaint = refused("simulate", "s.yaml")
    assert complaint.startswith(said)
    assert "(s.yaml, line 2)" in complaint


def test_option_of_a_part_from_a_file(refused, tmp_path):
    scenario(tmp_path, "./my_rov.py:my_rov, mass: heavy")
    said = "`plant.vehicle.mass` must be a number, but is 'heavy' (s.yaml, line 2)"
    assert named(refused("simulate", "s.yaml")) == named(said)


BYTES = """
import jax.numpy as jnp
from undertow.core.contracts import AbstractDisturbance


class Bytes(AbstractDisturbance):
    def realize(self, key):
        return ()

    def at(self, path, t, place, calm):
        return calm._replace(acceleration=calm.acceleration + jnp.sin(9 * t).astype(jnp.int8).astype(t.dtype))

    def jumps(self, duration):
        return ()


def my_bytes():
    return Bytes()
"""


@pytest.mark.full
def test_a_part_that_simd_lacks_is_reported_once_with_the_reason(undertow, tmp_path):
    (tmp_path / "my_bytes.py").write_text(BYTES)
    (tmp_path / "s.yaml").write_text(SMALL.replace("kind: sinusoid, amplitude: 1", "kind: ./my_bytes.py:my_bytes"))
    reason = "backend xla instead of simd (docs/explanation/simd.md): numbers of type int8."
    said = undertow("simulate", "s.yaml", "--out", "out")
    assert said.code == 0, said.err
    assert said.err.count(reason) == 1
    (tmp_path / "s.yaml").write_text(SMALL)
    assert "lack something" not in undertow("simulate", "s.yaml", "--out", "other").err
