"""The page of a designed experiment: the answer, the rehearsal, the deviations to expect, the script and its limits."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from undertow.core.atomic_io import write_whole
from undertow.core.number_text import plain
from undertow.report.answers.design_answer import answer_of_design
from undertow.report.answers.identification_answer import combination_in_words, in_words
from undertow.report.answers.plain_answer import answer_block
from undertow.report.figures.experiment import deviations_figure, rehearsal_figure
from undertow.report.figures.writing import save_all
from undertow.report.formats import captioned, number, prose, unit
from undertow.report.page import Html, bullets, document, join, section, table, tag
from undertow.report.quantities import quantity
from undertow.studies.identification.design_result import Design

_FORMS = {
    "telegraph": "to and fro at random, each way for less than a second",
    "slow telegraph": "to and fro at random, each way for a second or two",
    "multisine": "smooth swings of several frequencies together",
    "steps": "one way, the other way for twice as long, and back",
    "decay": "a push, and then nothing",
}
_CAPTIONS = {
    "rehearsal": "How far the simulated vehicle of the file goes from its station while the script runs. Beyond the "
    "dashed lines the script ends by itself.",
    "deviations": "What is left of the standard deviation of each number, of that before the experiment. Blue: numbers "
    "that the experiment is for. Grey, if any: further ones that are estimated. The line is at one half.",
}


def write_design(title: str, design: Design, data: Mapping[str, Any], out: Path, folder: Path) -> list[str]:
    """Write `experiment.html` and the figures; return a sentence for each figure that failed.

    Args:
        title: of the page.
        design: the experiment.
        data: contents of experiment.json.
        out: where to write.
        folder: where the files will be.

    Raises:
        OSError: the folder cannot be written.
    """
    rehearsal = design.rehearsal
    figures = {
        "rehearsal": lambda: rehearsal_figure(rehearsal.time, rehearsal.away, design.limits.room),
        "deviations": lambda: deviations_figure(data["parameters"]),
    }
    saved = save_all(lambda: figures, out / "figures", None)
    pictures = captioned(saved.vectors, _CAPTIONS)
    page = document(
        f"Experiment for {title}",
        tag("h1", prose(f"Experiment for {title}")),
        answer_block(answer_of_design(data, folder)),
        pictures.get("rehearsal", Html("")),
        *(tag("p", prose(sentence)) for sentence in saved.failures),
        section("numbers", "The numbers", pictures.get("deviations", Html("")), _numbers(data)),
        *_not_determined(data),
        section("script", "The script", _blocks(data)),
        section("limits", "What ends it", _limits(data)),
    )
    write_whole(out / "experiment.html", page)
    return saved.failures


def _numbers(data: Mapping[str, Any]) -> Html:
    rows = []
    for name, parameter in data["parameters"].items():
        deviations = (number(parameter["before"]), number(parameter["after"]))
        left = f"{100 * parameter['deviation_left']:.0f} %"
        rows.append((in_words(name), number(parameter["value"]), *deviations, left, unit(parameter["unit"])))
    columns = ("number", "file", "deviation before", "after", "left", "unit")
    return table(columns, rows, numeric=range(1, 5))


def _not_determined(data: Mapping[str, Any]) -> list[Html]:
    if not data["undetermined"]:
        return []
    sentences = [prose(f"{combination_in_words(combination)}.") for combination in data["undetermined"]]
    return [section("unknown", "What the experiment does not tell", bullets(sentences))]


def _blocks(data: Mapping[str, Any]) -> Html:
    blocks = enumerate(data["blocks"], 1)
    rows = [(i, b["form"], _FORMS[b["form"]], b["where"], quantity(b["size"], "")) for i, b in blocks]
    note = (
        "Blocks of ten seconds, one after the other; sizes are shares of the largest force of the thrusters that way."
    )
    return join(tag("p", note), table(("block", "form", "what", "where", "size"), rows, numeric=(0, 4)))


def _limits(data: Mapping[str, Any]) -> Html:
    limits = data["limits"]
    length, width, height = limits["room"]
    rows = [
        ("room around the station", f"{length:g} x {width:g} x {height:g} m"),
        ("depth", "{:.3g} to {:.3g} m".format(*limits["depth"])),
        ("roll, pitch, departure from the heading", quantity(limits["angle"], "rad")),
        ("angular velocity", f"{quantity(limits['rate'], 'rad')} per second"),
        ("input of a thruster", plain(limits["input"])),
    ]
    return table(("limit", "value"), rows)
