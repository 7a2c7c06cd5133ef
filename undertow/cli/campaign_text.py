"""The summary of a campaign, for the terminal."""

from rich.table import Table

from undertow.analysis.metrics import for_people
from undertow.campaign.store_results import Results
from undertow.report.campaign_tables import by_xla


def table(results: Results, found: dict) -> Table:
    """One row per combination of the swept values."""
    table = Table(title="Median [5 %, 95 %] of completed trials", title_justify="left", title_style="bold")
    swept = list(results.campaign.axes)
    counts = ("trials", "failed", "invalid") if found["invalid"] else ("trials", "failed")
    for column in (*swept, *counts, "within"):
        table.add_column(column)
    shown = [*results.tracking, "input_rms"]
    for name in shown:
        table.add_column(f"{name.replace('_', ' ')}, {for_people(0.0, results.unit(name))[1]}")
    for one in found["combinations"]:
        cells = [_spread(one["metrics"].get(name), results.unit(name)) for name in shown]
        table.add_row(
            *(one["values"][key] for key in swept), *(str(one[count]) for count in counts), _within(one), *cells
        )
    return table


def _within(one: dict) -> str:
    """Share of the trials of a combination that kept to the scenario's criterion of success."""
    judged = one["success"]["within"] + one["success"]["not_within"]
    return f"{100 * one['success']['within'] / judged:.1f} %" if judged else "-"


def _spread(quantiles: dict | None, unit: str) -> str:
    if quantiles is None:
        return "-"
    low, middle, high = (for_people(value, unit)[0] for value in quantiles.values())
    return f"{middle:.3g} [{low:.3g}, {high:.3g}]"


def sentences(found: dict) -> list[str]:
    """The numbers of trials by status, and the verdict on each requirement."""
    ended = ", ".join(f"{word} {number}" for word, number in found["status"].items())
    text = [f"{found['done']} trials: {ended}."]
    text += [sentence for sentence in (by_xla(found),) if sentence]
    text += [f"Invalid trials ({one['trials']} with this error): {one['why']}." for one in found["invalid"]]
    for one in found["combinations"]:
        of = "".join(f", {key} {value}" for key, value in one["values"].items())
        for requirement in one["requirements"]:
            low, high = (100 * bound for bound in requirement["interval"])
            bound = f"{requirement['metric']} < {requirement['below']:g}"
            text.append(
                f"Requirement {bound} in {100 * requirement['share']:g} % of the trials{of}: {requirement['verdict']}; "
                f"kept by {100 * requirement['kept']:.1f} % (95 % interval {low:.1f} to {high:.1f} %)."
            )
    return text
