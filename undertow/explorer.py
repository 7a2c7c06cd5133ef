"""A scenario with sliders in a notebook: a compiled loop that is run again whenever one moves."""

import html
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from undertow.core.errors import BadInput
from undertow.report.answers.notebook import in_notebook
from undertow.report.answers.run_answer import answer_of_run
from undertow.report.live_picture import live_picture
from undertow.report.page import document
from undertow.report.plotted import Plotted
from undertow.report.replay.replay_section import replay_looks, replay_section
from undertow.report.run_page import page_contents, shown_of
from undertow.run import Run, simulate_scenario
from undertow.scenario.reading import key_path
from undertow.scenario.results.run_result import ScenarioResult
from undertow.studies.tuning.problem import gains_in_force

try:
    import ipywidgets as widgets
    from IPython.core.getipython import get_ipython
except ImportError:
    widgets = get_ipython = None

Range = tuple[float, float] | Sequence[Any] | bool

_SPAN = 2.0  # an unnamed slider goes to twice the value
_MOST = 6  # sliders that nobody asked for
_STEPS = 100
# Where the numbers are that people turn first.
_FIRST = ("controller", "disturbance", "faults")


class Explorer:
    """Sliders, the answer and the first picture of the run with their values, and its replay on demand.

    Attributes:
        run: the latest run.
        values: what was moved, by key path.
    """

    def __init__(self, run: Run, ranges: Mapping[str, Range]):
        assert widgets is not None
        self.run, self.values = run, {}
        self._controls = {key: _control(key, choices, _in_force(run, key)) for key, choices in ranges.items()}
        self._picture, self._replay = widgets.HTML(), widgets.HTML()
        show_replay = widgets.Button(description="Replay in 3D", tooltip="of the run that is shown")
        show_replay.on_click(lambda button: self._show_replay())
        for key, control in self._controls.items():
            self.run.built_with({key: control.value if control.value is not None else control.options[0]})
            control.observe(lambda change, key=key: self._run_with(key, change["new"]), names="value")
        self.view = widgets.VBox([*self._controls.values(), self._picture, show_replay, self._replay])
        self._show()

    def _run_with(self, key: str, value: Any) -> None:
        """Run with another value at a key path, and show it; where it cannot be, that is said, and the run stays.

        What nobody has moved stays as the scenario has it, also where it leaves it to a default.
        """
        values = {**self.values, key: value}
        try:
            self.run = self.run.again(**values)
        except BadInput as error:
            self._picture.value = f"<p style='color:#b3402a'>{html.escape(str(error))}</p>"
            return
        self.values = values
        self._replay.value = ""
        self._show()

    def _show(self) -> None:
        result = self.run.result
        picture = live_picture(result, shown_of(result))
        self._picture.value = in_notebook(result.facts.title, answer_of_run(result), picture)

    def _show_replay(self) -> None:
        """The replay of the present run, in a frame of its own: its scripts must not meet those of the notebook."""
        contents = page_contents(self.run.result, lambda: Plotted({}, {}, []))
        if contents.replay is None:
            why = " ".join(contents.failures) or "Only a vehicle with thrusters has a replay."
            self._replay.value = f"<p>{html.escape(why)}</p>"
            return
        page = document(self.run.result.facts.title, replay_section([contents.replay]), looks=replay_looks())
        frame = "width:100%;height:640px;border:0"
        self._replay.value = f"<iframe style='{frame}' srcdoc='{html.escape(page, quote=True)}'></iframe>"

    def __repr__(self) -> str:
        return f"Sliders of {', '.join(self._controls) or 'nothing'}, in a Jupyter notebook.\n{self.run}"

    def _repr_mimebundle_(self, **options: Any) -> Any:
        return self.view._repr_mimebundle_(**options)


def explore(scenario: str | Path | Mapping[str, Any] | Run, ranges: Mapping[str, Range] | None = None) -> Explorer:
    """Show a scenario with sliders: whenever one moves, the loop runs again, and the picture follows.

        ut.explore("examples/bluerov2_heavy.yaml", {"disturbance[0].velocity[0]": (0, 1), "seed": (0, 20)})

    A run of 20 s of a vehicle takes some hundredths of a second, as nothing is compiled again. What changes the
    structure of the loop, such as another controller, is compiled once for each choice.

    Args:
        scenario: a file, the scenario as data, or a run of one.
        ranges: key path -> (lowest, highest) for a slider, with whole steps where both are whole numbers; a list of
            choices; or True or False for a switch. None for the numbers that the scenario states of its controller, its
            disturbances and its faults, from 0 to twice the value.

    A slider starts at the value in force, also where that is a default or a gain by rule; of one that differs by axis,
    at the geometric mean.

    Raises:
        BadInput: the scenario or a key path is wrong, the run is not one of a scenario, or ipywidgets is not installed.
    """
    if widgets is None or get_ipython is None:
        remedy = "In the folder of undertow, run: pip install -c constraints.txt '.[notebook]'"
        raise BadInput("", "", f"ipywidgets is not installed. {remedy}")
    run = scenario if isinstance(scenario, Run) else simulate_scenario(scenario)
    if not isinstance(run.result, ScenarioResult):
        hint = "Write it as a scenario, a file or a mapping, and give that to `ut.explore`"
        raise BadInput("scenario", "be a scenario or a run of one", "a run of a closed loop made of objects", hint=hint)
    if get_ipython() is None:
        what = "`ut.explore` shows its sliders in a Jupyter notebook, which this is not"
        instead = "Elsewhere, `run.again(controller__bandwidth=2.0)` runs the scenario of a run with other values"
        warnings.warn(f"{what}. {instead}", stacklevel=2)
    return Explorer(run, _ranges_of(run) if ranges is None else ranges)


def _control(key: str, choices: Range, in_force: Any) -> Any:
    """A slider, a list of choices or a switch, at the value in force.

    Where that is unknown, a slider starts in its middle; of a list that does not have it, nothing is chosen.
    """
    assert widgets is not None
    look = {"description": key, "style": {"description_width": "16em"}, "layout": widgets.Layout(width="48em")}
    if isinstance(choices, bool):
        return widgets.Checkbox(value=choices if in_force is None else bool(in_force), **look)
    if _is_range(choices):
        low, high = choices
        if not low < high:
            raise BadInput(key, "have a range from low to high", choices)
        start = min(max(in_force, low), high) if _is_number(in_force) else (low + high) / 2
        if isinstance(low, int) and isinstance(high, int) and (in_force is None or float(start).is_integer()):
            return widgets.IntSlider(value=round(start), min=low, max=high, **look)
        return widgets.FloatSlider(
            value=start, min=low, max=high, step=(high - low) / _STEPS, readout_format=".3g", **look
        )
    if not isinstance(choices, list) or not choices:
        raise BadInput(key, "have (lowest, highest), a list of choices, or a switch", choices)
    return widgets.Dropdown(options=choices, value=in_force if in_force in choices else None, **look)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_range(choices: Range) -> bool:
    return isinstance(choices, tuple) and len(choices) == 2 and all(map(_is_number, choices))


def _in_force(run: Run, key: str) -> Any:
    """The value of a run at a key path: what the scenario states, else its default; None where neither is known.

    A part is its name, and a gain that a rule sets is that of the law.
    """
    assert isinstance(run.result, ScenarioResult)
    built, path = run.result.built, key_path(key)
    value = _at(run.scenario, path)
    if value is None:
        value = _at(built.resolved, path)
    if value is None and path[:1] == ("controller",) and len(path) == 2:
        gains = gains_in_force(built, str(path[1]))
        value = None if gains is None else _mean(gains)
    return value.get("kind") if isinstance(value, dict) else value


def _mean(gains: np.ndarray) -> float:
    """Geometric mean over the axes, or that of numbers which are not positive."""
    return float(np.exp(np.log(gains).mean())) if np.all(gains > 0) else float(gains.mean())


def _at(node: Any, path: Sequence[str | int]) -> Any:
    """What stands at a key path; None where there is nothing."""
    for step in path:
        if isinstance(node, dict):
            node = node.get(step)
        elif isinstance(node, list) and isinstance(step, int) and step < len(node):
            node = node[step]
        else:
            return None
    return node


def _ranges_of(run: Run) -> dict[str, Range]:
    """Numbers that the scenario states where people turn first."""
    numbers: dict[str, Range] = {}

    def collect(node: Any, path: str) -> None:
        if isinstance(node, dict):
            for key, inner in node.items():
                collect(inner, f"{path}.{key}")
        elif isinstance(node, list):
            for place, inner in enumerate(node):
                collect(inner, f"{path}[{place}]")
        elif _is_number(node) and node > 0:
            numbers[path] = (0.0, _SPAN * node)

    for section in _FIRST:
        collect(run.scenario.get(section), section)
    return dict(list(numbers.items())[:_MOST])
