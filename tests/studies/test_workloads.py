"""The workloads that are timed, and the cases of `undertow bench`, are scenarios with the laws that they should have."""

import pytest

from undertow.scenario.reading import from_data
from undertow.scenario.validation import validate
from undertow.studies.speed.waiting import CASES
from undertow.studies.speed.workload import W1, W2

LAWS = {"W1": (W1, "paper"), "W2": (W2, "robust")}
LAWS |= {name: (case.scenario, "robust" if name == "heavy" else "paper") for name, case in CASES.items()}


@pytest.mark.parametrize("name", LAWS)
def test_law(name):
    scenario, preset = LAWS[name]
    law = validate(from_data(scenario)).controller.model_dump()
    assert (law["kind"], law["preset"]) == ("rcaf", preset)
