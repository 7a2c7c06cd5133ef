"""What a message says of an exception in a user's own code: the method, the line, the cause and the remedy."""

import jax
import jax.numpy as jnp
import pytest

from undertow.control import controllers
from undertow.core.catalogue import find, maker_in
from undertow.core.contracts import Target
from undertow.core.errors import BadInput
from undertow.core.user_code import fault_of, place_of, python_says
from undertow.physics.plants import double_integrator
from undertow.scenario.factory import derive_hint

OWN = '''"""A part."""

import math

import equinox as eqx
import numpy as np

from undertow.core.contracts import AbstractReference


class Mine(eqx.Module):
    gain: float = 1.0

    def decides(self, t):
        return 1 if t > 0 else 2

    def by_numpy(self, t):
        return np.sin(t)

    def by_math(self, t):
        return math.sin(t)

    def index(self, t):
        return [1, 2][t.astype(int)]

    def remembers(self, t):
        self.gain = t

    def near(self, r):
        return r.positon

    def inside(self, r):
        return HOLDER.mass

    def tuples(self, r):
        return r - r

    def missing(self, t):
        import no_such_module

    def long(self, t):
        raise ValueError("much " * 40)

    def calls(self, t):
        return self.long(t)

    def dumb(self, t):
        raise Dumb

    def abstract(self, t):
        return Half()

    def fine(self, t):
        return t


class Half(AbstractReference):
    pass


class Dumb(Exception):
    def __str__(self):
        raise RuntimeError("no words")


class Inner:
    mass = 3.0


class Holder:
    body = Inner()


HOLDER = Holder()


def mine():
    return Mine()


def another():
    return Mine()
'''

HINTS = {
    "decides": "Use `jnp.where(condition, a, b)`, `jnp.minimum` or `jnp.maximum`",
    "by_numpy": "Use `jax.numpy`",
    "by_math": "Keep the array, and use `jax.numpy`",
    "index": "Use `jnp.take`",
    "remembers": "Keep what changes in the state: it goes in as an argument and comes out as a result",
    "near": "Did you mean `position`?",
    "inside": "Did you mean `.body.mass`?",
    "tuples": "`y` and `r` are tuples of arrays: use `y.position` and `y.velocity`, and `r.position`, `r.velocity` and "
    "`r.acceleration`",
    "missing": "Install `no_such_module` beside undertow; if it is a file of yours, add its folder to PYTHONPATH",
    "long": "",
    "dumb": "",
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.py").write_text(OWN)
    return tmp_path


def failure(part, method):
    given = Target(*[jnp.ones(2)] * 3) if method in ("near", "inside", "tuples") else 1.0
    call = getattr(part, method) if method == "inside" or method == "tuples" else jax.jit(getattr(part, method))
    with pytest.raises(Exception) as caught:
        call(given)
    return caught.value


@pytest.mark.parametrize("method", HINTS)
def test_cause_place_and_remedy(folder, method):
    error = failure(find("references", "mine.py:mine", folder)(), method)
    says, hint = fault_of(error)
    before = OWN[: OWN.index(f"def {method}(")]
    assert says.startswith(f"cannot run `Mine.{method}`: ")
    assert says.endswith(f"(mine.py, line {before.count(chr(10)) + 2})")
    assert hint == HINTS[method]
    assert python_says(error) == (f"{says}. {hint}" if hint else says)


def test_long_messages_are_cut_and_missing_ones_named(folder):
    mine = find("references", "mine.py:mine", folder)()
    text = fault_of(failure(mine, "long")).says
    assert "ValueError: much much" in text and "... (mine.py" in text and len(text) < 180
    assert "Dumb: its message cannot be read" in fault_of(failure(mine, "dumb")).says


def test_the_innermost_function_is_named(folder):
    mine = find("references", "mine.py:mine", folder)()
    line = OWN[: OWN.index("def long(")].count("\n") + 2
    says = fault_of(failure(mine, "calls")).says
    assert says.startswith("cannot run `Mine.long`: ") and says.endswith(f"(mine.py, line {line})")


def test_a_class_that_lacks_methods(folder):
    mine = find("references", "mine.py:mine", folder)()
    says, hint = fault_of(failure(mine, "abstract"))
    line = OWN[: OWN.index("class Half")].count("\n") + 1
    assert says.startswith("cannot instantiate `Half`: method") and says.endswith(f"(mine.py, line {line})")
    assert "implemented" in says and hint == ""


def test_place_of_a_class_of_a_method_and_of_what_is_not_ones_own(folder):
    make = find("references", "mine.py:mine", folder)
    line = lambda text: f"mine.py, line {OWN[: OWN.index(text)].count(chr(10)) + 1}"
    assert place_of(make()) == place_of(type(make())) == line("class Mine")
    assert place_of(make(), "fine") == line("def fine")
    assert place_of(make) == line("def mine")
    assert place_of(1.0) == place_of(jnp.sin) == place_of(make(), "no_method") == ""
    made = type("Made", (), {"__module__": type(make()).__module__})
    assert place_of(made) == "mine.py"


def test_an_exception_of_somebody_elses_code_has_no_place():
    assert fault_of(ValueError("one\n two")).says == "ValueError: one two"


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("mine.py", "Add its name: mine.py:mine; others are another"),
        ("mine.py:mien", "Did you mean `mine`?"),
        ("none.py:mine", "must be an existing file"),
        ("empty.py", "`undertow init --own-controller` writes an example"),
        ("empty.py:", "name a function in empty.py"),
        ("broken.py:mine", "SyntaxError"),
        ("leaves.py:mine", "SystemExit"),
        ("gps", "Did you mean `position_fix`?"),
        ("dlv", "Did you mean `dvl`?"),
        ("odin", "`odin` is one of the vehicles: give it at `plant.vehicle`"),
    ],
)
def test_names_of_parts_that_do_not_work(folder, name, says):
    (folder / "empty.py").write_text("")
    (folder / "broken.py").write_text("def mine(:")
    (folder / "leaves.py").write_text("raise SystemExit(3)")
    with pytest.raises(BadInput) as caught:
        find("sensors", name, folder, what=name)
    assert says in str(caught.value)


class Plain:
    """A controller that is derived from nothing."""

    def __init__(self, model):
        self.model = model


@pytest.mark.parametrize("kind", ["controllers", ""])
def test_from_which_contract_to_derive(kind):
    """Of a function that takes `model` first it is known, whatever the names of the methods."""
    expected = {
        "controllers": "Derive `Plain` from AbstractController",
        "": "Derive `Plain` from AbstractPlant: it has `model`",
    }
    assert derive_hint(Plain(None), kind) == expected[kind]


def test_a_law_is_made_from_a_model_with_options_that_it_has():
    model = double_integrator(1).model()
    for make, says in (
        (lambda: controllers.pid(double_integrator(1)), "`model` must be the nominal model of a plant, but is of type"),
        (lambda: controllers.rcaf(double_integrator(1), preset="paper"), "Give it `plant.model()`"),
        (lambda: controllers.rcaf(model, preset="robust", trackin=1.0), "Did you mean `tracking`?"),
        (lambda: controllers.cascade(model, preset="plced"), "`preset` must be one of placed, ardusub, px4"),
    ):
        with pytest.raises(BadInput) as caught:
            make()
        assert says in str(caught.value)


def test_a_vehicle_file_is_no_plant(folder):
    hint = r"`plant: \{vehicle: mine\.yaml\}`"
    with pytest.raises(BadInput, match=hint):
        find("plants", "mine.yaml", folder)
    for kind, name in (("sensors", "mine.yaml"), ("plants", "mine")):
        with pytest.raises(BadInput) as caught:
            find(kind, name, folder)
        assert "vehicle file" not in str(caught.value)


def test_a_file_that_cannot_be_read_defines_nothing(folder):
    assert maker_in(folder / "no.py", "no.py").startswith("Add a function that makes the part")
