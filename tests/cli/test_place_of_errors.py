"""An error is worded once and says where the value stands: key path, file and line."""

import pickle

import pytest

from undertow.core.errors import BadInput, error_location
from undertow.scenario.reading import parse


def error_within(*places, name="mass", **said):
    """The error of code that stands in these places, outermost first."""
    if places:
        with error_location(*places[0]):
            return error_within(*places[1:], name=name, **said)
    return BadInput(name, "be positive", -1, **said)


def nowhere(name):
    return ""


@pytest.mark.parametrize(
    ("places", "name", "says"),
    [
        ([], "mass", "`mass` must be positive, but is -1"),
        ([("plant",), ("vehicle",)], "mass", "`plant.vehicle.mass` must be positive, but is -1"),
        ([("plant",)], "", "`plant` must be positive, but is -1"),
        ([("", "s.yaml: {}".format), ("plant",)], "mass", "`plant.mass` must be positive, but is -1 (s.yaml: plant.mass)"),
        # A file named in another has lines of its own; what it does not know is asked of the outer one.
        ([("", "s.yaml: {}".format), ("plant",), ("", "v.yaml: {}".format)], "mass",
         "`plant.mass` must be positive, but is -1 (v.yaml: mass)"),
        ([("", "s.yaml: {}".format), ("plant",), ("", nowhere)], "mass",
         "`plant.mass` must be positive, but is -1 (s.yaml: plant.mass)"),
        ([("", nowhere, "trial 7")], "mass", "`mass` must be positive, but is -1 (trial 7)"),
        ([("", "s.yaml: {}".format, "trial 7")], "mass", "`mass` must be positive, but is -1 (s.yaml: mass, trial 7)"),
    ],
)  # fmt: skip
def test_places_are_joined(places, name, says):
    assert str(error_within(*places, name=name)) == says


def test_a_location_that_is_given_stays():
    assert error_within(("plant", "s.yaml: {}".format), where="own.py, line 3").where == "own.py, line 3"


def test_a_place_ends_with_its_block_also_after_an_error():
    with pytest.raises(BadInput), error_location("plant"):
        raise BadInput("mass", "be positive")
    assert BadInput("mass", "be positive").name == "mass"


def test_an_error_that_comes_from_another_process_keeps_its_place():
    sent = pickle.dumps(error_within(("plant", "s.yaml: {}".format)))
    with error_location("controller"):
        received = pickle.loads(sent)
    assert str(received) == "`plant.mass` must be positive, but is -1 (s.yaml: mass)"


def test_location_of_a_key_or_of_the_nearest_that_encloses_it(tmp_path):
    text = parse("plant:\n  vehicle:\n    mass: 3\n  sensors:\n  - depth\n", "s.yaml", tmp_path, "SCENARIO")
    assert text.location("plant.vehicle.mass") == "s.yaml, line 3"
    assert text.location("plant.sensors[0].noise") == "s.yaml, line 5"
    assert text.location("plant.vehicle.weight") == "s.yaml, line 2"
    assert text.location("loop.dt") == "s.yaml"
