"""The replay as a part of a page: data, three.js and the script inside the page, nothing loaded from anywhere."""

from collections.abc import Sequence
from importlib.resources import files

from undertow.core.user_code import python_says
from undertow.report.formats import prose
from undertow.report.page import Html, section, tag
from undertow.report.replay.replay_data import ReplayData, page_data

_THREE_JS = ("jupyter_threejs_sage", "static/r130/three.min.js")
# One after the other they are one script; the first are those of any page with vehicles in three dimensions.
_SCENE = ("elements.js", "scene.js", "panels.js")
_SCRIPTS = ("unpack.js", "replay.js")
MISSING_THREE_JS = (
    "The package jupyter_threejs_sage, which holds three.js, is not installed. Run: pip install "
    "jupyter-threejs-sage==130"
)
_KEYS = (
    "Drag to turn the view, drag with two fingers or the right button to move it; click it before you zoom with the "
    "wheel. Space plays and pauses, the arrow keys step by 1 s (with Shift by 10 s). Add `#t=12` to the address of the "
    "page to open it at 12 s. Arrows at the thrusters show the force on the vehicle, computed from the recorded input "
    "with the model of the thruster."
)


def replay_section(replays: Sequence[ReplayData], caption: str = "") -> Html:
    """A section with the replay of one run, or of several in one scene; of each, label and colour differ.

    Without the package that holds three.js, a sentence that says how to install it.
    """
    three = three_js()
    if three is None:
        return section("replay", "Replay", tag("p", f"There is no replay: {MISSING_THREE_JS}"))
    script = "\n".join([scene_script(), *(_text(name) for name in _SCRIPTS)])
    return section(
        "replay",
        "Replay",
        *([tag("p", prose(caption))] if caption else []),
        Html('<div class="replay" data-source="replay-data"><p>The replay needs JavaScript.</p></div>'),
        tag("p", prose(_KEYS), class_="small"),
        Html(f'<script type="application/json" id="replay-data">{page_data(replays)}</script>'),
        Html(f"<script>{three}</script>"),
        Html(f'<script>"use strict";\n(() => {{\n{script}}})();\n</script>'),
    )


def not_made(error: Exception, of: str = "") -> str:
    """A sentence for a replay that could not be made."""
    return f"the replay{of} could not be made ({python_says(error)}); the results are complete"


def replay_looks() -> str:
    """Style sheet of the replay."""
    return _text("replay.css")


def scene_script() -> str:
    """Script of the scene and of the panels beside it, for a page that shows vehicles at an instant."""
    return "\n".join(_text(name) for name in _SCENE)


def three_js() -> str | None:
    """The text of three.js, with its licence; None where the package that holds it is missing."""
    package, name = _THREE_JS
    try:
        return files(package).joinpath(name).read_text(encoding="utf-8")
    except (ModuleNotFoundError, FileNotFoundError):
        return None


def _text(name: str) -> str:
    return files("undertow.report.replay").joinpath(name).read_text(encoding="utf-8")
