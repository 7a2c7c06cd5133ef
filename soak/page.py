"""The page of a soak: what was tried, what was counted, what failed, and how to repeat it."""

from collections.abc import Mapping, Sequence
from typing import Any

from undertow.report.page import Html, bullets, document, join, section, table, tag

_SHOWN = 100  # failures in the page; all of them are in soak.json


def soak_page(summary: Mapping[str, Any]) -> str:
    """The whole page as text, from the data of soak.json."""
    failed = len(summary["failures"])
    verdict = f"{failed or 'No'} never-event{'s' if failed > 1 else ''} occurred."
    facts = f"undertow {summary['version']}, Python {summary['python']}, {summary['machine']}, seed {summary['seed']}."
    sections = [_SECTIONS[part](results) for part, results in summary["parts"].items()]
    return document(
        summary["title"],
        tag("h1", summary["title"]),
        tag("p", f"{verdict} {facts} It took {_time(summary['seconds'])}.", class_="lead"),
        section("events", "Never-events", _events(summary)),
        *([section("failures", "Failures", *_failures(summary["failures"]))] if failed else []),
        *sections,
    )


def _events(summary: Mapping[str, Any]) -> Html:
    rows = [(event, str(count), summary["meanings"][event]) for event, count in summary["events"].items()]
    return table(("event", "count", "meaning"), rows, (1,))


def _failures(failures: Sequence[Mapping[str, Any]]) -> list[Html]:
    rows = [(failure["identity"], failure["event"], failure["says"]) for failure in failures[:_SHOWN]]
    command = tag("code", "python -m soak --replay IDENTITY")
    hint = join("To repeat one alone, run ", command, ". Its files are in the folder failures/.")
    return [tag("p", hint), table(("identity", "event", "what happened"), rows, wide=True)]


def _inputs(results: Mapping[str, Any]) -> Html:
    words = (
        f"{results['number']} hostile inputs were tried in {_time(results['seconds'])}. Each must be accepted, or "
        "refused by one line that names the place, within 1 s of processor time and without files left behind. The "
        f"slowest rejection took {results['slowest']:.2f} s. There were {results['messages']} different messages."
    )
    endings = ("accepted", "refused", "failed")
    rows = [(kind, *(str(counts.get(ending, 0)) for ending in endings)) for kind, counts in results["counts"].items()]
    return section("inputs", "Hostile inputs", tag("p", words), table(("kind", *endings), rows, (1, 2, 3)))


def _kills(results: Mapping[str, Any]) -> Html:
    words = (
        f"{results['campaigns']} campaigns of {results['trials']} trials were ended {results['kills']} times by "
        f"kill -9, Ctrl-C or SIGTERM at random moments and resumed, in {_time(results['seconds'])}. Their tables are "
        "compared byte by byte with that of a campaign that was left alone."
    )
    also = (
        f"files of the unfinished table that were cut off or changed before resuming: {results['damaged']}",
        f"processes whose files could not grow, as on a full disk: {results['disk_full']}",
        f"processes that were started while another one was writing: {results['second']}",
    )
    return section("kills", "Kills", tag("p", words), bullets(also))


def _hours(results: Mapping[str, Any]) -> Html:
    before, after = results["memory"]
    words = (
        f"{results['hours']:g} vehicle-hours in waves, current and noise were simulated in "
        f"{_time(results['seconds'])}. At every control step the input and the states were checked. The first and the "
        f"last hour of each run are compared. The process had {before:.0f} MB before and at most {after:.0f} MB, "
        "compilers included."
    )
    head = (
        "loop",
        "runs",
        "h each",
        "completed",
        "false alarms",
        "rms first, m",
        "rms last, m",
        "change, %",
        "weights first",
        "last",
    )
    rows = [
        (
            row["loop"],
            str(row["runs"]),
            f"{row['hours']:g}",
            str(row["completed"]),
            str(row["alarms"]),
            f"{row['first_rms']:.4g}",
            f"{row['last_rms']:.4g}",
            f"{100 * row['largest_change']:.2g}",
            f"{row['first_weights']:.3g}",
            f"{row['last_weights']:.3g}",
        )
        for row in results["rows"]
    ]
    return section("hours", "Simulated hours", tag("p", words), table(head, rows, range(1, len(head)), wide=True))


def _faults(results: Mapping[str, Any]) -> Html:
    words = (
        f"{results['number']} runs with random faults were simulated under supervision in {_time(results['seconds'])}; "
        f"{results['repeated']} of them were built and run once more in other company, and must have the same bytes."
    )
    states = table(
        ("state at the end", "runs"), [(word, str(count)) for word, count in results["states"].items()], (1,)
    )
    ended = table(("how runs ended", "runs"), [(word, str(count)) for word, count in results["endings"].items()], (1,))
    modes = sorted(results["modes"].items(), key=lambda item: (-item[1], item[0]))
    kinds = table(("target and mode", "faults"), [(mode, str(count)) for mode, count in modes], (1,))
    return section("faults", "Faults", tag("p", words), ended, states, kinds)


def _controls(results: Mapping[str, Any]) -> Html:
    words = (
        "The law of the paper without protection must fail in these ways, and succeed without what causes each "
        "failure. A soak in which they do not fail would not notice failures."
    )
    rows = [
        (
            control["identity"],
            "fails" if control["fails"] else "DOES NOT FAIL",
            control["says"],
            control["found"],
            control["beside"],
        )
        for control in results["rows"]
    ]
    head = ("control", "verdict", "why", "with the cause", "without it")
    return section("controls", "Negative controls", tag("p", words), table(head, rows, wide=True))


def _links(results: Mapping[str, Any]) -> Html:
    words = (
        f"{results['number']} runs of link commands were attacked in {_time(results['seconds'])}: signals, "
        "standstills, full disks, wrong, old, repeated, reordered and damaged messages, and messages of others. Each "
        "must end with the vehicle stopped in the stated time, and no single message or signal may give full thrust "
        "for 0.5 s."
    )
    head = ("link", "runs", "with a never-event", "V s undisturbed", "V s worst")
    head += ("full thrust after one message, s", "longest full thrust, s", "furthest, m", "until neutral, s")
    keys = ("undisturbed_volt_seconds", "worst_volt_seconds", "full_after_one", "full", "furthest", "neutral_after")
    rows = [
        (row["link"], str(row["runs"]), str(row["failed"]), *(f"{row[key]:.4g}" for key in keys))
        for row in results["rows"]
    ]
    worst = [
        (row["identity"], f"{row['volt_seconds']:.4g}", f"{row['full']:.2f}", row["plan"]) for row in results["worst"]
    ]
    left_out = [f"{link} was left out: {why}." for link, why in results["left_out"].items()]
    return section(
        "links",
        "Links",
        tag("p", words),
        table(head, rows, range(1, len(head)), wide=True),
        table(("run", "V s", "full thrust, s", "what happened"), worst, (1, 2), wide=True),
        *([bullets(left_out)] if left_out else []),
    )


_SECTIONS = {
    "inputs": _inputs,
    "kills": _kills,
    "hours": _hours,
    "faults": _faults,
    "controls": _controls,
    "links": _links,
}


def _time(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 300 else f"{seconds / 60:.0f} minutes"
