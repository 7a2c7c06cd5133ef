"""The short of a campaign, for the terminal."""

from rich.table import Table

from undertow.analysis.metrics import for_people
from undertow.campaign.store_results import Results
from undertow.report.campaign_tables import by_xla


def table(results: Results, found: dict) -> Table:
    """A row for each combination."""
    table = Table(title="Median [5 %, 95 %] of the trials that lasted", title_justify="left", title_style="bold")
    crossed = list(results.campaign.axes)
    counts = ("trials", "failed", "refused") if found["refused"] else ("trials", "failed")
    for column in (*crossed, *counts, "within"):
        table.add_column(column)
    shown = [*results.tracking, "input_rms"]
    for name in shown:
        table.add_column(f"{name.replace('_', ' ')}, {for_people(0.0, results.unit(name))[1]}")
    for one in found["combinations"]:
        cells = [_spread(one["metrics"].get(name), results.unit(name)) for name in shown]
        table.add_row(
            *(one["values"][key] for key in crossed), *(str(one[count]) for count in counts), _within(one), *cells
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
    """Endings and verdicts in words."""
    ended = ", ".join(f"{word} {number}" for word, number in found["status"].items())
    said = [f"{found['done']} trials: {ended}."]
    said += [sentence for sentence in (by_xla(found),) if sentence]
    said += [f"Refused, {one['trials']} as here: {one['why']}." for one in found["refused"]]
    for one in found["combinations"]:
        of = "".join(f", {key} {value}" for key, value in one["values"].items())
        for wanted in one["requirements"]:
            low, high = wanted["interval"]
            asked = f"{wanted['metric']} < {wanted['below']:g} in {100 * wanted['share']:g} % of the trials{of}"
            said.append(
                f"{asked}: {wanted['verdict']}; {100 * wanted['kept']:.1f} % did [{100 * low:.1f}, {100 * high:.1f}]."
            )
    return said
