"""Figure: cost against the number of evaluations of a tuning."""

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from undertow.report.figures import style

_WIDE = 10.0  # ratio of costs from which on their axis is logarithmic


def tuning_figure(results: Mapping[str, Any]) -> Figure:
    """Best training cost against the number of evaluations, and the costs of the given and tuned gains on both sets.

    Args:
        results: contents of tuning.json.
    """
    figure = style.blank(6.4, 3.4)
    style.head(figure, "Cost of the best gains", {"training": style.SOLID, "held out": style.DASHED})
    panel = style.place(figure, 0.62, 0.55, 5.5, 2.3)
    steps, end = results["history"], results["evaluations"]
    tried = [step["evaluations"] for step in steps] + [end]
    costs = [step["cost"] for step in steps] + [steps[-1]["cost"]]
    if max(costs) > _WIDE * min(costs):  # else numbers between powers of ten would run into the label
        panel.set_yscale("log")
    panel.step(tried, costs, where="post", color=style.SOLID.colour, linewidth=style.SOLID.width)
    for name, look in (("train_cost", style.SOLID), ("held_out_cost", style.DASHED)):
        for evaluations, gains_name in ((0, "given"), (end, "tuned")):
            cost = results["gains"][gains_name][name]
            panel.plot(evaluations, cost, "o", color=look.colour, markersize=4, clip_on=False, zorder=5)
    panel.set_xlim(0, end)
    style.label(panel, "evaluations", "cost")
    return figure
