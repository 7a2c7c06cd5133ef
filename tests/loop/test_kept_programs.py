"""Programs of XLA that are kept: found by their structure without tracing, and never those of another one."""

import dataclasses
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core import checks, installation, kept_programs, program_key
from undertow.core.errors import BadInput
from undertow.core.kept_programs import kept_program, kept_result, kept_values
from undertow.core.process_setup import KEEP_PROGRAMS
from undertow.core.structure_key import Constant
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2, odin, remus100


def of_undertow(function):
    """As one of undertow, which has a key; in the full set its own are wrapped by checks of their annotations."""
    function.__module__ = "undertow.core.kept_programs"
    return function


@of_undertow
def matvec(matrix, vector):
    return matrix @ vector


@of_undertow
def pseudo_inverse(matrix):
    return jnp.linalg.pinv(matrix)


@of_undertow
def inverse(matrix):
    return jnp.linalg.inv(matrix)


@of_undertow
def largest_forces(model, count):
    held = model.quasi_static()
    low, high = held.range(held.init(), jnp.ones(()))
    return jnp.broadcast_to(jnp.maximum(-low, high), (count,))


MATRIX, VECTOR = jnp.asarray([[1.0, 2.0], [3.0, 5.0]]), jnp.asarray([0.3, -0.7])


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache of its own, in a process without code of others, which the tests themselves are."""
    monkeypatch.setenv("UNDERTOW_CACHE", str(tmp_path))
    monkeypatch.setenv(KEEP_PROGRAMS, "1")
    return tmp_path / "native"


@pytest.fixture
def untraced(monkeypatch):
    """Fails where a program is made anew."""

    def forbid():
        monkeypatch.setattr(kept_programs, "_made", lambda *arguments: pytest.fail("a program was traced"))

    return forbid


def entries(folder):
    return sorted(folder.glob("*.xla"))


def test_a_later_process_finds_it_without_tracing(folder, untraced):
    expected = kept_program(matvec)(MATRIX, VECTOR)
    np.testing.assert_array_equal(expected, jax.jit(matvec)(MATRIX, VECTOR))
    assert len(entries(folder)) == 1
    untraced()
    again = kept_program(matvec)
    np.testing.assert_array_equal(again(MATRIX, VECTOR), expected)
    np.testing.assert_array_equal(again(2 * MATRIX, VECTOR), 2 * expected)


def test_another_structure_is_another_program(folder):
    run = kept_program(matvec)
    run(MATRIX, VECTOR)
    run(jnp.ones((3, 2)), VECTOR)
    with jax.enable_x64(False):
        assert run(MATRIX.astype("float32"), VECTOR.astype("float32")).dtype == "float32"
    assert len(entries(folder)) == 3
    assert run(jnp.ones((3, 2)), VECTOR).shape == (3,)


@pytest.mark.parametrize("change", ["sources", "flags"])
def test_other_code_and_settings_are_another_program(folder, monkeypatch, change):
    kept_program(matvec)(MATRIX, VECTOR)
    if change == "sources":
        monkeypatch.setattr(program_key, "installation", lambda: ("other sources",))
    else:
        monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_enable_fast_math=false")
    kept_program(matvec)(MATRIX, VECTOR)
    assert len(entries(folder)) == 2


@pytest.mark.parametrize("damage", ["cut off", "one bit", "empty", "another's", "of no use"])
def test_damaged_entries_are_made_again(folder, monkeypatch, damage):
    expected = kept_program(matvec)(MATRIX, VECTOR)
    kept_program(matvec)(jnp.ones((3, 2)), VECTOR)
    first, other = entries(folder)
    contents = first.read_bytes()
    if damage == "one bit":
        first.write_bytes(contents[:200] + bytes([contents[200] ^ 1]) + contents[201:])
    elif damage == "another's":
        first.write_bytes(other.read_bytes())
    elif damage == "of no use":  # whole, but no program
        monkeypatch.setattr(kept_programs, "kept_code", lambda key, make: b"no program")
    else:
        first.write_bytes(contents[: len(contents) // 2] if damage == "cut off" else b"")
    for matrix in (MATRIX, jnp.ones((3, 2))):
        np.testing.assert_array_equal(kept_program(matvec)(matrix, VECTOR), jax.jit(matvec)(matrix, VECTOR))
    np.testing.assert_array_equal(kept_program(matvec)(MATRIX, VECTOR), expected)


def test_nothing_is_kept_beside_code_of_others(tmp_path, monkeypatch):
    """As here, where the tests are loaded: their modules may have changed anything."""
    monkeypatch.setenv("UNDERTOW_CACHE", str(tmp_path))
    assert __name__ in installation.foreign_modules()
    kept_program(matvec)(MATRIX, VECTOR)
    assert not entries(tmp_path / "native")


@pytest.mark.full
def test_a_command_has_no_code_of_others_until_a_scenario_names_some(tmp_path):
    """In a process of its own, as here the tests are loaded."""
    (tmp_path / "mine.py").write_text("def mine():\n    return None\n")
    code = [
        "import undertow.cli.simulate",
        "from undertow.core.catalogue import find",
        "from undertow.core.installation import foreign_modules",
        "print(foreign_modules())",
        "find('controllers', 'mine.py:mine')",
        "print(len(foreign_modules()))",
    ]
    command = [sys.executable, "-c", f"import sys; sys.modules.pop('__main__'); {'; '.join(code)}"]
    shown = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert shown.splitlines() == ["[]", "1"]


def test_functions_of_others_are_compiled_and_not_kept(folder):
    double = kept_program(lambda x: 2 * x)
    np.testing.assert_array_equal(double(VECTOR), 2 * VECTOR)
    assert not entries(folder)


@pytest.mark.full
@pytest.mark.parametrize("function", [pseudo_inverse, inverse])
def test_programs_that_call_lapack_run_where_nothing_has_called_it(folder, function):
    """In a process of its own: JAX puts LAPACK in place when it lowers such a call, and a kept program lowers nothing."""
    matrix = jnp.asarray([[2.0, 0.5], [0.5, 1.0]])
    expected = kept_program(function)(matrix)
    np.testing.assert_allclose(expected @ matrix, np.eye(2), atol=1e-12)
    (entry,) = entries(folder)
    code = [
        "import pickle, pathlib, jax, numpy",
        "jax.config.update('jax_enable_x64', True)",
        f"kept = pathlib.Path({str(entry)!r}).read_bytes()[32:]",  # behind the checksum
        "program = pickle.loads(kept)",
        "print((program((jax.device_put(numpy.array([[2.0, 0.5], [0.5, 1.0]])),)) + 0).tolist())",
    ]
    command = [sys.executable, "-c", "; ".join(code)]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert shown.strip() == str(expected.tolist())


def test_arrays_of_numpy_are_arguments(folder):
    """Or every record of a run would be a program of its own."""
    run = kept_program(matvec)
    for scale in (1.0, 2.0):
        matrix, vector = scale * np.asarray(MATRIX), np.asarray(VECTOR)
        np.testing.assert_allclose(run(matrix, vector), matrix @ vector, rtol=1e-15)
    assert len(entries(folder)) == 1


def test_inside_a_trace_it_is_a_part_of_it(folder):
    run = kept_program(matvec)
    np.testing.assert_allclose(jax.jacfwd(lambda v: run(MATRIX, v))(VECTOR), MATRIX)
    assert not entries(folder)


def counted(calls):
    @of_undertow
    def halves(matrix, scale):
        calls.append(scale)
        return {"half": matrix / 2, "words": ("scale", scale)}

    return kept_values(halves)


def test_values_are_kept_by_the_numbers_of_their_arguments(folder):
    calls = []
    for _ in range(2):  # as two processes do
        for scale in (1.0, 2.0):
            kept = counted(calls)(scale * MATRIX, scale)
            assert kept["words"] == ("scale", scale)
            assert isinstance(kept["half"], jax.Array) and kept["half"].dtype == MATRIX.dtype
            np.testing.assert_array_equal(kept["half"], scale * MATRIX / 2)
    assert calls == [1.0, 2.0]
    with jax.enable_x64(False):
        assert counted(calls)(MATRIX.astype("float32"), 1.0)["half"].dtype == "float32"
    assert calls == [1.0, 2.0, 1.0]


def test_kept_values_may_be_used_inside_a_trace(folder):
    calls = []
    run = counted(calls)
    used = jax.jit(lambda vector: run(MATRIX, 1.0)["half"] @ vector)
    np.testing.assert_allclose(used(VECTOR), MATRIX @ VECTOR / 2)
    np.testing.assert_array_equal(run(MATRIX, 1.0)["half"], MATRIX / 2)  # no value of a trace was kept
    kept = entries(folder)
    np.testing.assert_allclose(jax.jacfwd(lambda scale: run(MATRIX * scale, 1.0)["half"])(1.0), MATRIX / 2)
    assert kept and entries(folder) == kept


def test_a_search_does_not_fill_the_disk_with_values(folder, monkeypatch):
    monkeypatch.setattr(kept_programs, "_MOST_VALUES", 3)
    calls = []
    run = counted(calls)
    for scale in range(10):
        np.testing.assert_array_equal(run(scale * MATRIX, 1.0)["half"], scale * MATRIX / 2)
    assert len(calls) == 10 and len(entries(folder)) == 3


def test_parts_are_arguments(folder):
    """A fidelity level is another program, another supply is not."""
    kept = kept_program(largest_forces)
    for thruster in (t200(supply=16), t200(supply=12), t200(supply=12, fidelity="static")):
        model = thruster.actuator_model(8, False)
        np.testing.assert_allclose(kept(model, 8), largest_forces(model, 8), rtol=1e-12)
    assert len(entries(folder)) == 2


def test_a_check_that_passed_is_not_repeated(folder):
    calls = []
    for vehicle in (odin(), odin(), bluerov2()):
        kept_result("check", vehicle, lambda vehicle=vehicle: calls.append(vehicle))
    assert len(calls) == 2

    def refuse():
        calls.append("refused")
        checks.positive("mass", -1.0)

    for _ in range(2):
        with pytest.raises(BadInput, match="`mass` must be positive"):
            kept_result("check", remus100(), refuse)
    assert calls[2:] == ["refused", "refused"]


def test_a_result_is_kept_for_the_numbers_that_it_was_computed_of(folder):
    calls = []

    def mass(vehicle):
        calls.append(vehicle.name)
        return float(vehicle.mass)

    heavier = dataclasses.replace(odin(), mass=odin().mass + 1)
    for vehicle in (odin(), heavier, odin(), heavier):
        found = kept_result("mass", Constant(vehicle), lambda vehicle=vehicle: mass(vehicle))
        assert found == float(vehicle.mass)
    assert len(calls) == 2
    assert kept_result("another", odin(), lambda: "computed") == "computed"
