"""Figure: inputs of every thruster, with separate scales for start-up and the rest of the run."""

from matplotlib.figure import Figure

from undertow.report.figures import signals, style
from undertow.report.figures.multiples import Block, small_multiples
from undertow.report.figures.tracking import Controllers
from undertow.report.figures.uncertainty import settled


def effort(title: str, runs: Controllers) -> Figure:
    """Figs. 9 and 13."""
    first = next(iter(runs.values()))
    looks = [(run, *style.CONTROLLERS[key]) for key, run in runs.items()]
    curves = [signals.curve(run, name, "input", look) for run, name, look in looks]
    start, end = settled(first), float(first["time"].values[-1])
    labels = signals.per_input(first, "voltage")
    return small_multiples(
        title,
        [f"thruster {number}" for number in first["actuator"].values],
        [
            Block(curves, labels, height=0.95, window=(0.0, start), titled=True),
            Block(curves, labels, height=0.95, width=2.1, window=(start, end)),
        ],
        columns=2,
        beside=True,
    )
