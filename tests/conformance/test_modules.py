"""The package: every module imports, everything public is documented, every class is abstract or final."""

import importlib
import inspect
import pkgutil
from pathlib import Path

import equinox as eqx
import pytest

import undertow
from undertow.core import catalogue
from undertow.core.part_packages import PACKAGE_OF

NAMES = sorted(info.name for info in pkgutil.walk_packages(undertow.__path__, "undertow."))


def modules():
    return [importlib.import_module(name) for name in NAMES if not name.endswith("__main__")]


def public(module):
    """Functions and classes that a module defines and does not hide."""
    for name, thing in vars(module).items():
        defined = getattr(thing, "__module__", None) == module.__name__
        if defined and not name.startswith("_") and (inspect.isclass(thing) or inspect.isroutine(thing)):
            yield name, thing


def classes():
    found = {cls for module in modules() for _, cls in inspect.getmembers(module, inspect.isclass)}
    return sorted((cls for cls in found if issubclass(cls, eqx.Module)), key=lambda cls: cls.__qualname__)


def is_abstract(cls):
    """Whether something is left open: it cannot be made."""
    left = (getattr(cls, name, ()) for name in ("__abstractmethods__", "__abstractvars__", "__abstractclassvars__"))
    return any(left)


@pytest.mark.full
def test_every_module_imports():
    assert len(modules()) > 50
    assert all(module.__doc__ for module in modules()), [m.__name__ for m in modules() if not m.__doc__]


@pytest.mark.full
def test_everything_public_is_documented():
    missing = [f"{m.__name__}.{name}" for m in modules() for name, thing in public(m) if not inspect.getdoc(thing)]
    assert not missing


@pytest.mark.full
def test_everything_is_ascii():
    files = [Path(module.__file__) for module in modules() if module.__file__]
    assert not [file for file in files if not file.read_text(encoding="utf-8").isascii()]


@pytest.mark.full
def test_classes_are_abstract_or_final():
    ours = [cls for cls in classes() if cls.__module__.startswith("undertow.")]
    assert len(ours) > 20
    for cls in ours:
        for base in cls.__mro__[1:]:
            if base is not eqx.Module and issubclass(base, eqx.Module):
                assert is_abstract(base), f"{cls.__qualname__} inherits from {base.__qualname__}, which is final"


@pytest.mark.full
def test_abstract_classes_say_so():
    for cls in classes():
        if cls.__module__.startswith("undertow."):
            assert cls.__name__.startswith("Abstract") == is_abstract(cls), cls.__qualname__


def overridden(classes_of_interest):
    """Methods of a class that its base already has an implementation of."""
    for cls in classes_of_interest:
        for name, value in vars(cls).items():
            for base in cls.__mro__[1:]:
                inherited = vars(base).get(name)
                ours = base.__module__.startswith("undertow.") and not name.startswith("__")
                if ours and callable(value) and callable(inherited) and not is_abstract_method(inherited):
                    yield f"{base.__qualname__}.{name}", cls.__qualname__


def is_abstract_method(method):
    return getattr(method, "__isabstractmethod__", False)


# Capabilities that a part may have, with the default of a part that has not:
# a thruster that is commanded in newtons and not in volts, whose motor is known, or with a number for each of N;
# a navigation filter that simulates sensors; faults that say what is random in them;
# a controller that knows its acceleration, has knowledge to carry over, or can be restarted.
CAPABILITIES = {
    "AbstractThruster": ("limits", "terminal", "electrical_power", "actuator_model", "count"),
    "AbstractFaults": ("sampled",),
    "AbstractNavigation": ("simulated_sensors",),
    "AbstractController": ("known_acceleration", "knowledge", "restarted"),
}
STILL_OVERRIDDEN = {f"{part}.{capability}" for part in CAPABILITIES for capability in CAPABILITIES[part]}


@pytest.mark.full
def test_no_concrete_method_is_overridden():
    found = {name for name, _ in overridden(c for c in classes() if c.__module__.startswith("undertow."))}
    assert found <= STILL_OVERRIDDEN, found - STILL_OVERRIDDEN


@pytest.mark.full
def test_the_check_sees_an_overridden_method():
    """Negative control."""
    base = next(cls for cls in classes() if cls.__name__ == "AbstractOutputCoordinates")
    heir = type("Heir", (base,), {"__module__": __name__, "velocity": lambda self, y: y})
    assert ("AbstractOutputCoordinates.velocity", "Heir") in set(overridden([heir]))


@pytest.mark.full
def test_the_check_sees_an_heir_of_a_final_class():
    """Negative control."""
    final = next(cls for cls in classes() if cls.__module__.startswith("undertow.") and not is_abstract(cls))
    assert not is_abstract(type("Heir", (final,), {"__module__": __name__}))


@pytest.mark.parametrize("name", ["vehicles", "thrusters", "plants", "controllers"])
def test_unknown_part_is_named_in_the_error(name):
    with pytest.raises(AttributeError, match="has no part `nothing_like_it`"):
        _ = importlib.import_module(PACKAGE_OF[name]).nothing_like_it


def test_parts_with_presets_are_named_by_their_package():
    """So that a preset is found without loading every part of its kind."""
    for kind, package in PACKAGE_OF.items():
        named = getattr(importlib.import_module(package), "WITH_PRESETS", ())
        assert sorted(named) == sorted(
            name for name, part in catalogue.names(kind).items() if catalogue.presets_of(part)
        )
