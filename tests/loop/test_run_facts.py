"""What is known of a run, as attributes of its result file and back."""

import math
import re
from pathlib import Path

import pytest

import undertow
from undertow.analysis.success import Success
from undertow.analysis.temporal.requirements import Verdict
from undertow.control.supervision.conditions import State
from undertow.control.supervision.transition_log import SupervisorTransition
from undertow.core.metric import Metric
from undertow.core.status import Status
from undertow.scenario.reading import from_data
from undertow.scenario.results.run_facts import RunFacts, facts_from

FACTS = RunFacts(
    status=Status.DIVERGED,
    ended=1.25,
    sentence="It diverged.",
    title="a run",
    seed=7,
    steady=None,
    whole={"position_rms": 0.5, "error_rms_axes": [0.1, 0.2]},
    meanings={"position_rms": Metric("m", "size of the position error, rms")},
    scenario=from_data({"plant": "odin", "steady": {"start": 1.0, "stop": 2.0}, "faults": [{"mode": "off"}]}).data,
    success=Success({"position_rms": 0.05}, {}, False),
    requirements={"settles": Verdict(-0.2, False)},
    certificate={"function": "V", "start": 1.0},
    navigation={"sensors": [], "nees": 9.0, "findings": []},
    transitions=[SupervisorTransition(0.5, State.SAFE, "saturated", 2.0, 1.0)],
    code="{}",
    left_to_xla="a reason",
    versions={"version_undertow": "0.1.0", "machine": "Linux"},
)


def test_attributes_say_everything():
    assert facts_from(FACTS.attributes()) == FACTS


def test_a_run_of_objects_has_no_scenario():
    without = FACTS._replace(scenario={}, code="", success=None, certificate=None, transitions=None, requirements={})
    attributes = without.attributes()
    assert not {"scenario", "code", "success", "certificate", "transitions", "requirements"} & attributes.keys()
    assert facts_from(attributes) == without
    assert without.window is None and without.faults == () and without.hull is None


def test_what_the_scenario_says():
    sized = FACTS._replace(scenario={"plant": {"vehicle": {"contents": {"size": [1.0, 0.5, 0.4]}}}})
    assert FACTS.window == (1.0, 2.0) and FACTS.faults == [{"mode": "off"}] and FACTS.hull is None
    assert sized.hull == [1.0, 0.5, 0.4]


def test_numbers_that_are_not_finite_are_none_in_the_file_only():
    infinite = FACTS._replace(whole={"position_rms": math.inf, "error_rms_axes": [math.nan]})
    assert infinite.whole["position_rms"] == math.inf
    assert facts_from(infinite.attributes()).whole == {"position_rms": None, "error_rms_axes": [None]}


@pytest.mark.parametrize("change", [{"status": "unknown"}, {"metrics": "{"}, {"ended": "late"}])
def test_attributes_that_were_not_written_so_are_refused(change):
    with pytest.raises(ValueError):
        facts_from(FACTS.attributes() | change)


def test_attributes_of_runs_are_read_in_one_place():
    """Whoever has a run has its facts: nobody parses the attributes of a dataset beside `facts_from`."""
    package = Path(undertow.__file__).parent
    parsed = re.compile(r"attrs(\[|\.get\()\"(metrics|metric_meanings|success|requirements|navigation|transitions)")
    found = [path.name for path in package.rglob("*.py") if parsed.search(path.read_text(encoding="utf-8"))]
    assert found == []
