"""Tuning with equal budgets as a table and in sentences."""

from undertow.studies.comparison.equal_budgets import EqualBudgets, Runs, TunedLaw
from undertow.studies.comparison.sentences import digits
from undertow.studies.comparison.tables import TextTable

_HEAD = (
    "controller",
    "tuned numbers",
    "evaluations",
    "training cost, default gains",
    "training cost, tuned",
    "held-out cost, default gains",
    "held-out cost, tuned",
    "spectral radius",
)


def budget_rows(budgets: EqualBudgets) -> TextTable:
    """A row for each law."""
    return TextTable(_HEAD, [_row(law) for law in budgets.laws])


def _row(law: TunedLaw) -> tuple[str, ...]:
    if law.train is None or law.held_out is None or law.radius is None:
        return (law.name, *("-" for _ in _HEAD[1:]))
    costs = map(digits, (*law.train, *law.held_out))
    return (law.name, str(law.parameters), str(law.evaluations), *costs, f"{law.radius:.5f}")


def budget_sentences(budgets: EqualBudgets) -> list[str]:
    """The budget, what the laws were tuned on, what they are judged on, and which were not tuned."""
    sentences = [
        "Every controller was tuned by mutation and selection (`undertow tune --method evolution`) with "
        f"{budgets.budget} evaluations of its gains."
    ]
    if budgets.train is not None and budgets.held_out is not None:
        sentences[0] += f" Training: {_words(budgets.train)}. Held out: {_words(budgets.held_out)}."
        sentences += [
            "The trials of the tables and figures are held out too: they have seeds of their own, and where the "
            "scenario has several parameter sets or waves, held-out sets and wave heights (section Configuration). The "
            "nominal model of the controllers stays the same."
        ]
    sentences += [f"{law.name} is judged as it is: {law.untuned}." for law in budgets.laws if law.untuned]
    return sentences


def _words(runs: Runs) -> str:
    seeds = f"{runs.seeds} {'seed' if runs.seeds == 1 else 'seeds'}"
    sizes = f"disturbance times {', '.join(f'{size:g}' for size in runs.sizes)}"
    sets = f", parameter sets {', '.join(runs.sets)}" if runs.sets else ""
    return f"{runs.runs} runs with {seeds}, {sizes}{sets}"
