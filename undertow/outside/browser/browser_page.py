"""The page of a scenario that a visitor drives: modules, numbers and scripts in one file, nothing is loaded."""

import base64
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import jax
import numpy as np

from undertow.control.supervision.conditions import State
from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.core.status import Status
from undertow.outside.browser.live_loop import LiveLoop, live_loop
from undertow.outside.browser.live_numbers import NEVER
from undertow.outside.browser.wasm import StructLayout, check_wasm_compiler, compiled_to_wasm, layout_of
from undertow.outside.export.c_program import CProgram, Exported, check_compiler
from undertow.report.formats import prose
from undertow.report.page import Html, document, tag
from undertow.report.replay.replay_data import page_json, vehicle_alone
from undertow.report.replay.replay_section import MISSING_THREE_JS, replay_looks, scene_script, three_js
from undertow.scenario.build import Built, in_its_precision
from undertow.scenario.results.run_facts import hull_of

_SCRIPTS = ("engine.js", "steering.js", "strips.js", "story.js", "live.js")  # one after the other they are one script
_BOUND = 0.05  # m, of the position error that the page calls small, where the scenario has no bound for success
_KEYS = (
    "Keys: W and S or the arrows move the set-point forward and back, A and D to the sides, Q and E turn it, R and F "
    "move it up and down; Space pauses. On a phone, hold the buttons. Drag the view to turn it. All is computed in "
    "this page: the scenario as C code, compiled to WebAssembly, in {precision}."
)


def export_page(built_by_law: Mapping[str, Built]) -> Exported:
    """`index.html`, in which a visitor drives the vehicle of a scenario by one or several controllers.

    Args:
        built_by_law: name of the controller -> the scenario with it; they differ in their controllers only. The page
            begins with the first.

    Raises:
        BadInput: there is no compiler, three.js is missing, or the scenario has no page, see `live_loop`.
    """
    check_wasm_compiler()
    check_compiler()
    three = three_js()
    if three is None:
        raise BadInput("--wasm", "have three.js", "without it", hint=MISSING_THREE_JS)
    with runtime.on_processor():
        laws = [_law_data(built, name) for name, built in built_by_law.items()]
    built = next(iter(built_by_law.values()))
    data = _scene_data(built) | {"laws": laws}
    title = built.scenario.description or "A vehicle in current and waves"
    page = document(
        title,
        tag("h1", prose(title)),
        Html('<div class="replay live" data-source="live-data"><p>The page needs JavaScript.</p></div>'),
        tag("p", _KEYS.format(precision=built.scenario.precision), class_="small"),
        Html(f'<script type="application/json" id="live-data">{page_json(data)}</script>'),
        Html(f"<script>{three}</script>"),
        Html(f'<script>"use strict";\n(() => {{\n{_script()}}})();\n</script>'),
        looks=replay_looks() + _text("live.css"),
    )
    return Exported({"index.html": page})


@in_its_precision
def _law_data(built: Built, name: str) -> dict[str, Any]:
    """The closed loop with one controller for `engine.js`: module, layouts of its memory, sliders and switches."""
    live = live_loop(built)
    program = CProgram(live.system)
    layouts = {struct: layout_of(program.fields[struct]) for struct in ("state", "input", "output")}
    leaves = live.numbers.leaves()
    member = lambda leaf: f"numbers_{leaves.index(leaf)}"
    sliders = [
        {key: value for key, value in slider._asdict().items() if key != "tables"}
        | {"tables": {member(leaf): [_encoded(array) for array in arrays] for leaf, arrays in slider.tables.items()}}
        for slider in live.numbers.sliders
    ]
    switches = [
        {"label": switch.label, "member": member(switch.leaf), "thruster": switch.thruster}
        for switch in live.numbers.switches
    ]
    loop_data = {
        "period": live.system.period,
        "never": NEVER,
        "layouts": {struct: layout._asdict() for struct, layout in layouts.items()},
        "input": base64.b64encode(_input_bytes(live, layouts["input"])).decode(),
        "sliders": sliders,
        "switches": switches,
    }
    module = base64.b64encode(compiled_to_wasm(program)).decode()
    return {"name": name, "loop": loop_data, "module": module}


@in_its_precision
def _scene_data(built: Built) -> dict[str, Any]:
    """Vehicle, start and words for `live.js`."""
    plant = built.closed_loop.plant
    initial = built.scenario.initial
    position, _ = built.closed_loop.outputs_at_start(initial.position, initial.velocity)
    success = built.resolved.get("success")
    return {
        "vehicle": vehicle_alone(built.closed_loop, hull_of(built.resolved)),
        "start": np.asarray(position, dtype=float)[:3].tolist(),
        "input_unit": plant.input_unit,
        "bound": success.get("position_rms", _BOUND) if isinstance(success, dict) else _BOUND,
        "states": [{"name": state.name, "meaning": state.meaning} for state in State],
        "statuses": [status.sentence for status in Status],
    }


def _input_bytes(live: LiveLoop, layout: StructLayout) -> bytes:
    """The struct of the input at the start, byte by byte."""
    content = bytearray(layout.bytes)
    arrays = [np.asarray(leaf) for leaf in jax.tree.leaves(live.system.inputs) if leaf.size]
    for place, array in zip(layout.members.values(), arrays, strict=True):
        content[place["offset"] : place["offset"] + array.nbytes] = array.tobytes()
    return bytes(content)


def _encoded(array: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def _script() -> str:
    return "\n".join([scene_script(), *(_text(name) for name in _SCRIPTS)])


def _text(name: str) -> str:
    return files("undertow.outside.browser").joinpath(name).read_text(encoding="utf-8")
