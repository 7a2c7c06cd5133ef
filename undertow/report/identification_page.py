"""The page of an identification: the answer, how it predicts, what is known of each number, what to do next."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from undertow.core.atomic_io import write_whole
from undertow.report.answers.identification_answer import (
    answer_of_identification,
    combination_in_words,
    in_words,
    mean_fits,
    profile_words,
)
from undertow.report.answers.notebook import in_notebook
from undertow.report.answers.plain_answer import answer_block
from undertow.report.figures.identification import Series, free_run_figure, intervals_figure
from undertow.report.figures.writing import Plots, save_all, small_png
from undertow.report.formats import captioned, number, prose, unit
from undertow.report.identified_numbers import VERDICTS, findings_of, interval_of
from undertow.report.page import Html, bullets, document, figure, join, section, table, tag
from undertow.studies.identification.identify import Identification
from undertow.studies.identification.validation import AXES, whole_values

_CAPTIONS = {
    "free_run": "Velocities of a dive that was not used for the estimate. The model starts from the measured motion at "
    "the beginning and is then driven by the logged inputs alone. The number at the right is the fit: 100 % is "
    "perfect, 0 % is no better than the mean.",
    "intervals": "Estimates as multiples of the value in the vehicle file, with their 95 % intervals. Blue: determined "
    "by the dives. Orange: partly. Grey: the interval is about as wide as what was known before. Numbers that are 0 "
    "in the file are in the table below only.",
}
_SURE = (
    "An interval contains the true value in 95 of 100 cases if the model has the right form. It allows for "
    "disturbances that last for seconds, and for estimates that differ from dive to dive. It cannot allow for what the "
    "model lacks: the free run above tells whether that matters. In vehicle.yaml `+-` is one standard deviation: "
    "about half of what the interval has to each side."
)


def write_identification(
    title: str, identification: Identification, data: Mapping[str, Any], out: Path, folder: Path, pdf: str | None = None
) -> list[str]:
    """Write `identification.html` and the figures; return a sentence for each figure that failed.

    Args:
        title: of the page.
        identification: result.
        data: contents of identification.json.
        out: where to write.
        folder: where the files will be.
        pdf: width of PDF files; None for none.

    Raises:
        OSError: the folder cannot be written.
    """
    saved = save_all(lambda: identification_plots(identification, data), out / "figures", pdf)
    pictures = captioned(saved.vectors, _CAPTIONS)
    page = document(
        f"Identification of {title}",
        tag("h1", prose(f"Identification of {title}")),
        answer_block(answer_of_identification(data, folder)),
        pictures.get("free_run", Html("")),
        *(tag("p", prose(sentence)) for sentence in saved.failures),
        section("dives", "The dives", _dives(data), *findings_of(data)),
        section("numbers", "The numbers", pictures.get("intervals", Html("")), tag("p", prose(_SURE)), _numbers(data)),
        *_not_determined(data),
        section("prediction", "Prediction of dives not used", _fits(data), _ahead(data), _white(data)),
    )
    write_whole(out / "identification.html", page)
    return saved.failures


def in_notebook_of(identification: Identification, data: Mapping[str, Any]) -> Html:
    """An identification as a notebook shows it: the answer and one figure."""
    plots = identification_plots(identification, data)
    name = "free_run" if "free_run" in plots else "intervals"
    picture = figure(small_png(plots[name]()), name, _CAPTIONS[name], prose(_CAPTIONS[name]))
    return in_notebook("Identification", answer_of_identification(data), picture)


def identification_plots(identification: Identification, data: Mapping[str, Any]) -> Plots:
    """Functions that make the figures, by name."""
    figures: dict[str, Any] = {"intervals": lambda: intervals_figure(data["parameters"])}
    if identification.validation:
        figures["free_run"] = lambda: _free_run(identification)
    return figures


def _free_run(identification: Identification):
    """The figure of the longest dive that was left out."""
    validation = max(identification.validation, key=lambda one: len(one.identified.free_run))
    step = identification.dives[0].step
    series: dict[str, Series] = {}
    for axis in identification.velocities:
        measured, error = whole_values(validation.dive, axis), validation.identified.error(axis)
        there = np.isfinite(error)
        if there.any():
            time = step * np.arange(len(error))[there]
            series[axis] = (time, measured[there], (measured + error)[there])
    return free_run_figure(series, validation.identified.fit)


def _dives(data: Mapping[str, Any]) -> Html:
    rows = [(dive["name"], number(dive["duration"]), ", ".join(dive["sensors"])) for dive in data["dives"]]
    return table(("log", join("duration, ", unit("s")), "measured"), rows, numeric=(1,))


def _numbers(data: Mapping[str, Any]) -> Html:
    rows = []
    for name, parameter in data["parameters"].items():
        interval, verdict = interval_of(parameter), VERDICTS[parameter["verdict"]]
        before, after = parameter["prior"], parameter["value"]
        values = (number(before), number(after), f"{round(100 * (after / before - 1)):+d} %" if before else "")
        rows.append((in_words(name), *values, interval, profile_words(parameter), unit(parameter["unit"]), verdict))
    columns = ["number", "file", "estimate", "change", "95 % interval", "by the profile", "unit", ""]
    if not any("profile" in parameter for parameter in data["parameters"].values()):
        columns.remove("by the profile")
        rows = [(*row[:5], *row[6:]) for row in rows]
    return table(columns, rows, numeric=(1, 2, 3, 4))


def _not_determined(data: Mapping[str, Any]) -> list[Html]:
    if not data["undetermined"]:
        return []
    sentences = [prose(f"{combination_in_words(combination)}.") for combination in data["undetermined"]]
    return [section("unknown", "What the dives do not tell", bullets(sentences))]


def _white(data: Mapping[str, Any]) -> Html:
    """Whether residuals are noise."""
    coloured = [name for name, test in data["residuals"].items() if not test["is_white"]]
    if not coloured:
        return tag("p", "What remains unexplained looks like noise in every sensor (autocorrelation over 20 samples).")
    sentence = (
        f"What is left between model and measurement in {', '.join(coloured)} is more than noise of the sensors: it "
        "lasts longer than a sample, or goes with the inputs. The intervals are wider for it. Its cause is a "
        "disturbance, or something that the model lacks; where the fits are near 100 % it is small."
    )
    if data["method"] == "output_error":
        sentence += " If a tether or eddies pulled at the vehicle, compare with `--method prediction_error`."
    return tag("p", prose(sentence))


def _fits(data: Mapping[str, Any]) -> Html:
    rows = []
    for validation in data["validation"]:
        for whose, label in (("identified", "identified"), ("prior", "vehicle file")):
            fits = validation[whose]["free_run_fit"]
            rows.append((validation["name"], label, *(number(fits.get(axis), 2) for axis in AXES)))
    rows += _mean_rows(data)
    head = ("fit of the free run, %", "model", *AXES)
    return table(head, rows, numeric=range(2, 2 + len(AXES)))


def _mean_rows(data: Mapping[str, Any]) -> list[tuple[Any, ...]]:
    """Mean fits beside those of published parameter sets; none for a vehicle without."""
    if not data["published"]:
        return []
    is_unseen = any(validation["is_unseen"] for validation in data["validation"])
    label = "mean of the dives that no estimate used" if is_unseen else "mean"
    fits = mean_fits(data)
    of_models = {
        "identified": {axis: own for axis, (own, _) in fits.items()},
        "vehicle file": {axis: before for axis, (_, before) in fits.items()},
    }
    of_models |= {f"published: {name}": of_set for name, of_set in data["published"].items()}
    return [(label, model, *(number(row.get(axis), 2) for axis in AXES)) for model, row in of_models.items()]


def _ahead(data: Mapping[str, Any]) -> Html:
    """Rms of the errors some seconds ahead, over all dives."""
    names = list(
        dict.fromkeys(name for v in data["validation"] for row in v["identified"]["rms_ahead"].values() for name in row)
    )
    rows = []
    for horizon in dict.fromkeys(h for v in data["validation"] for h in v["identified"]["rms_ahead"]):
        for whose, label in (("identified", "identified"), ("prior", "vehicle file")):
            cells = []
            for name in names:
                errors = [v[whose]["rms_ahead"][horizon].get(name) for v in data["validation"]]
                errors = [error for error in errors if error is not None]
                cells.append(number(float(np.sqrt(np.mean(np.square(errors)))) if errors else None))
            rows.append((f"{horizon} s", label, *cells))
    if not names:  # dives, or parts of one, that are too short for a look ahead
        return Html("")
    return table(("error ahead, rms", "model", *names), rows, numeric=range(2, 2 + len(names)), wide=True)
