"""The table of all tools."""

import itertools
from typing import Any


def table(rows: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    """Rows by problem and time, with what each takes as a multiple of simdjit."""
    lines = [("problem", "tool", "setting", "ns per run and second", "times simdjit")]
    problem = lambda row: row["problem"]
    for name, group in itertools.groupby(sorted(rows, key=problem), problem):
        ranked = sorted(group, key=lambda row: row["ns"] or float("inf"))
        ours = min(row["ns"] for row in ranked if row["tool"].startswith("simdjit"))
        for row in ranked:
            numbers = (spaced(row["ns"]), spaced(float(f"{row['ns'] / ours:.2g}"))) if row["ns"] else ("", "")
            lines.append((name, row["tool"], row["setting"], *numbers))
    return lines


def spaced(value: float) -> str:
    return f"{value:,.0f}".replace(",", " ") if value >= 10 else f"{value:.2g}"
