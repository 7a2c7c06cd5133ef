"""The answer of a run: verdict, numbers in people's units, and what limits it."""

import numpy as np
import pytest

from undertow.analysis.metrics import MEANINGS
from undertow.analysis.success import evaluate_success
from undertow.core.status import Status
from undertow.report.answers.run_answer import answer_of_run
from undertow.report.quantities import quantity
from undertow.scenario.results.run_facts import RunFacts
from undertow.scenario.results.run_result import RunRecord

CRITERION = {"position_rms": 0.05, "attitude_rms": 0.05, "saturated_fraction": 0.25}
GOOD = {
    "position_rms": 0.0147,
    "attitude_rms": 0.00257,
    "saturated_fraction": 0.0,
    "position_max": 0.0417,
    "attitude_max": 0.0123,
    "input_peak": 8.9,
    "energy": 15_157.0,
    "position_uncertainty_rms": 0.7,
    "position_estimation_rms": 0.056,
}


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (0.0147, "m", "1.5 cm"),
        (2e-6, "m", "less than 1 mm"),
        (0.0042, "m", "4.2 mm"),
        (-1.377, "m", "1.4 m".replace("1", "-1", 1)),
        (2345.0, "m", "2.3 km"),
        (0.05, "rad", "2.9 degrees"),
        (1e-5, "rad", "less than 0.01 degrees"),
        (np.radians(1.0), "rad", "1 degree"),
        (12.345, "s", "12.3 s"),
        (0.25, "", "25 %"),
        (12.2, "1", "12"),
        (15_157.0, "J", "15 kJ"),
        (126.3, "W", "126 W"),
        (120.0, "s", "120 s"),
    ],
)
def test_quantities_have_the_units_of_people(value, unit, words):
    assert quantity(value, unit) == words


def record(make_run, steady=GOOD, off=0.0, certificate=None, status=Status.OK, **facts):
    run = make_run(axes=6, inputs=8)
    run["measured_position"] = run["position"] + off
    meanings = {name: metric._replace(unit=metric.unit.replace("[input]", "V")) for name, metric in MEANINGS.items()}
    whole = GOOD if steady is None else steady
    scenario = {"steady": {"start": 10.0, "stop": 20.0}, "plant": {"thruster": {"supply": 16}}}
    success = evaluate_success(CRITERION, steady)
    return RunRecord(
        run,
        RunFacts(
            status,
            120.0,
            status.sentence,
            "title",
            0,
            steady,
            whole,
            meanings,
            scenario,
            success,
            certificate=certificate,
            **facts,
        ),
    )


def test_a_good_run_says_so_with_numbers_and_limits(make_run):
    good, verdict, (judged, largest, effort, limited) = answer_of_run(record(make_run))
    assert good and verdict == "It went well from 10 to 20 s."
    assert judged.startswith(
        "Position error, rms per axis 1.5 cm (limit 5 cm); attitude error, rms per axis 0.15 degrees"
    )
    assert largest == "Largest error: 4.2 cm in position and 0.7 degrees in attitude."
    assert effort == "Inputs in the whole run: up to 8.9 V of 16 V, never at the limits; 15 kJ, 126 W on average."
    assert limited.startswith("What limits it: 8 % of the loads is not compensated.")


def test_what_exceeds_its_limit_comes_first(make_run):
    good, verdict, (judged, *_) = answer_of_run(record(make_run, GOOD | {"attitude_rms": 0.5}))
    assert (
        good is False
        and verdict.startswith("It did not go well")
        and judged.startswith("Attitude error, rms per axis 29 deg")
    )


def test_each_limit_has_its_reason(make_run):
    last = lambda *arguments, **options: answer_of_run(record(make_run, *arguments, **options)).lines[-1]
    assert "the inputs, which are at their limits" in last(GOOD | {"saturated_fraction": 0.1})
    assert "whose position is 1.2 cm off" in last(off=0.012)
    unmoved = {"hypotheses": [{"name": "rank", "steady": 0.0}]}
    assert "axes along which no input acts" in last(GOOD | {"position_rms": 1.0}, certificate=unmoved)
    assert "limits it" not in last(GOOD | {"position_rms": 1e-5})


def test_a_run_that_ended_early_did_not_go_well(make_run):
    good, verdict, lines = answer_of_run(record(make_run, None, status=Status.DIVERGED))
    assert good is False and verdict == f"It did not go well: diverged after 120 s. {Status.DIVERGED.sentence}"
    assert lines[0].startswith("Largest error in the whole run") and np.all(["limits it" not in line for line in lines])
