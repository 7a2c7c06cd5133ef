"""The page of an identified thruster: the answer, points and curve, the numbers, and what the record does not tell."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from undertow.core.atomic_io import write_whole
from undertow.core.runtime import in_precision
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.report.answers.identification_answer import in_words
from undertow.report.answers.plain_answer import answer_block
from undertow.report.answers.thruster_answer import NAMES, answer_of_thruster
from undertow.report.figures.thruster_bench import bench_figure
from undertow.report.figures.writing import save_all
from undertow.report.formats import captioned, number, prose, unit
from undertow.report.identified_numbers import VERDICTS, findings_of, interval_of
from undertow.report.page import Html, document, join, section, table, tag
from undertow.studies.identification.bench.bench_response import settled_response
from undertow.studies.identification.bench.bench_table import UNIT_OF
from undertow.studies.identification.bench.identify_thruster import ThrusterIdentification

_CAPTION = (
    "Thrust over the voltage at the motor, which is duty times supply: rows of the bench (grey) and the identified "
    "thruster (blue) with its 95 % interval. Below: predicted less measured thrust of each row. An error that changes "
    "its sign slowly is what the form of the thruster lacks. With a record over time, the last panel shows a step."
)
_SURE = (
    "An interval contains the true value in 95 of 100 cases if the thruster has the right form. Errors of neighbouring "
    "rows are alike, and intervals allow for that. They do not allow for what the bench itself does: a tank that is "
    "too small, a load cell that is not calibrated, a supply that sags."
)
_GRID = 201


def write_thruster_page(
    title: str,
    identification: ThrusterIdentification,
    others: Mapping[str, AbstractThruster],
    data: Mapping[str, Any],
    out: Path,
    folder: Path,
    pdf: str | None = None,
) -> list[str]:
    """Write `identification.html` and the figure; return a sentence for each figure that failed.

    Args:
        title: of the page.
        identification: result.
        others: thrusters that were compared, by name.
        data: contents of identification.json.
        out: where to write.
        folder: where the files will be.
        pdf: width of PDF files; None for none.

    Raises:
        OSError: the folder cannot be written.
    """
    plot = lambda: _plot(identification, others)
    saved = save_all(lambda: {"thrust": plot}, out / "figures", pdf)
    pictures = captioned(saved.vectors, {"thrust": _CAPTION}).values()
    page = document(
        f"Thruster of {title}",
        tag("h1", prose(f"Thruster of {title}")),
        answer_block(answer_of_thruster(data, folder)),
        *pictures,
        *(tag("p", prose(sentence)) for sentence in saved.failures),
        section("numbers", "The numbers", tag("p", prose(_SURE)), *(_numbers(form) for form in data["forms"])),
        section("prediction", "Prediction of rows left out", _errors(data)),
        section("records", "The records", _records(data), *findings_of(data)),
    )
    write_whole(out / "identification.html", page)
    return saved.failures


def _plot(identification: ThrusterIdentification, others: Mapping[str, AbstractThruster]):
    largest = identification.largest
    grid = np.linspace(-largest if identification.best.problem.form.reverse else 0.0, largest, _GRID)
    with in_precision("float64"):
        thrusts = {
            name: np.asarray(settled_response(thruster, jnp.asarray(grid)).thrust) for name, thruster in others.items()
        }
    return bench_figure(identification.best, thrusts, grid)


def _numbers(form: Mapping[str, Any]) -> Html:
    rows = []
    for name, parameter in form["parameters"].items():
        interval, verdict = interval_of(parameter), VERDICTS[parameter["verdict"]]
        rows.append((in_words(name), number(parameter["value"]), interval, unit(parameter["unit"]), verdict))
    for direction, thrust in form["full_thrust"].items():
        interval = interval_of(thrust)
        rows.append((f"full thrust, {direction}", number(thrust["value"]), interval, unit("N"), ""))
    kind = f"{NAMES[form['form']]} ({form['section']['kind']})"
    return table((kind, "estimate", "95 % interval", "unit", ""), rows, numeric=(1, 2))


def _errors(data: Mapping[str, Any]) -> Html:
    quantities = [name for name in UNIT_OF if any(name in form["rms_left_out"] for form in data["forms"])]
    rows = []
    for form in data["forms"]:
        errors = (number(form["rms_left_out"].get(name)) for name in quantities)
        rows.append((NAMES[form["form"]], *errors))
    for name, rms in data["compared"].items():
        rows.append((f"{name}, not fitted", number(rms), *(number(None) for _ in quantities[1:])))
    head = ("error, rms", *(join(f"{name}, ", unit(UNIT_OF[name])) for name in quantities))
    return table(head, rows, numeric=range(1, 1 + len(quantities)))


def _records(data: Mapping[str, Any]) -> Html:
    rows = []
    for bench in data["bench"]:
        low, high = bench["supply"]
        supply = number(low) if low == high else join(number(low), " to ", number(high))
        duration = number(bench["duration"])
        rows.append((bench["name"], str(bench["rows"]), supply, duration, ", ".join(bench["measured"])))
    head = ("file", "rows", join("supply, ", unit("V")), join("duration, ", unit("s")), "measured")
    return table(head, rows, numeric=(1, 2, 3))
