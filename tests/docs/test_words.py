"""Words that were retired in favour of the field's own (see the glossary) do not come back: in names, keys, help, text.

A retired word is looked for as a whole word and as a part of a name (`told`, `as_told`, `ToldLaw`), ignoring case.
"""

import functools
import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.docs

ROOT = Path(__file__).parents[2]
TEXTS_OF_THE_PROJECT = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CODE_OF_CONDUCT.md", "paper.md", ".github")
SEARCHED = ("undertow", "soak", "docs", "examples", "benchmarks", *TEXTS_OF_THE_PROJECT)
SUFFIXES = {".py", ".md", ".ipynb", ".yaml", ".yml", ".css", ".html", ".cff"}

# Retired word (a regular expression) -> the field's word.
RETIRED = {
    r"rungs?": "fidelity level",
    r"ladders?": "fidelity levels",
    r"told": "given, nominal, set",
    r"untold": "unknown to the nominal model",
    r"sound version": "robust variant",
    r"sound law": "robust law",
    r"sound(?:ed|er)?": "robust, valid, finite",
    r"hear(?:s|d|ing)?": "update, receive",
    r"unheard": "not received",
    r"drawn": "sampled, realized; plotted",
    r"draws?": "sample, realization",
    r"drawing(?:s)?": "sampling; figure",
    r"books": "diagnostics, energy balance",
    r"flown": "run, simulated",
    r"fl(?:y|ies|ew)": "run, simulate",
    r"flying": "running",
    r"foret(?:ell|ells|old)": "predict",
    r"foresee[sn]?": "predict",
    r"foresight": "prediction",
    r"judgement": "comparison, evaluation",
    r"workshop": "part cache",
    r"dials?": "tunable parameter",
    r"hangar": "program cache",
    r"crew": "group",
    r"fleet": "batch runner",
    r"lanes?": "SIMD batch",
    r"instruments?": "sensor",
    r"ticks?": "control step",
    r"doubts?": "warning",
    r"truths": "plant variants",
    r"calm": "load",
    r"freedoms": "degrees of freedom",
    r"wanted": "desired, reference; required",
    r"circumstances": "context",
    r"refusals?": "invalid trial, error",
    r"gathering": "basis norm squared",
    r"keep_sound": "freeze on failure",
    r"health": "status",
    r"downhill": "gradient descent",
    r"journal": "checkpoint",
    r"crossed": "swept",
    r"contests?": "comparison",
    r"contestants?": "candidate",
    r"wet": "under water",
    r"the sea": "disturbances",
    r"whole motors?": "full motor model",
    r"voltage_rms": "input_rms",
    r"energy_defect_share": "energy_integration_residual",
    r"energy_books_share": "energy_balance_residual",
    r"told once|looked at once": "evaluated once",
}

# A file (or a folder) and the retired words that mean something else there.
ALLOWED = {
    "docs/explanation/simd.md": {r"lanes?"},  # vector lanes of a processor
    "undertow/report/figures": {r"ticks?"},  # matplotlib's axes
    "undertow/paper/figures": {r"ticks?"},
    # The health of thrusters, which fault-tolerant control calls so.
    "undertow/core/contracts.py": {r"health"},
    "undertow/core/measurement.py": {r"health"},
    "undertow/physics/faults/injected.py": {r"health"},
    "undertow/studies/comparison/step_time.py": {r"health"},
    "undertow/control/supervision/": {r"health"},
    "undertow/outside/autopilot/": {r"health"},
    "undertow/outside/realtime/": {r"health"},
    "undertow/outside/export/controller.py": {r"health"},
    "docs/how-to/supervisor.md": {r"health"},
    "docs/how-to/thruster-faults.md": {r"health"},
    "docs/how-to/real-time.md": {r"health"},
    "docs/how-to/autopilot.md": {r"health"},
    "docs/how-to/vehicle.md": {r"health"},
    "docs/how-to/faults.md": {r"health"},
}

# Phrases in which a retired word is the field's word, or somebody else's name.
PHRASES = re.compile(
    r"lanes_of|when the sound left|admin\.tick\.interval|tick_params"
    r"|canvas\.draw\(|draw_artist|echo.sounder|journal article|-journal\b|charge[ _]drawn|Nonlinear Dynamics|fly[- ]?wheel",
    re.I,
)


def split_names(line: str) -> str:
    """`as_told` and `ToldLaw` as separate words."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", line).replace("_", " ")


def files() -> list[Path]:
    """Every text file that is searched; not those that the build of the site makes."""
    roots = [ROOT / name for name in SEARCHED]
    found = [path for root in roots for path in ([root] if root.is_file() else root.rglob("*"))]
    made = {ROOT / "docs" / name for name in ("_build", "gallery", ".jupyter_cache")}
    return sorted(path for path in found if path.suffix in SUFFIXES and not made & set(path.parents))


TEXTS = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in files()}


@functools.cache
def all_words(name: str, text: str) -> str:
    """What the lines of a file and its name are searched for, at once."""
    cleaned = [PHRASES.sub("", line) for line in (name, *text.splitlines())]
    return "\n".join([*cleaned, *map(split_names, cleaned)])


@functools.cache
def different_words(name: str, text: str) -> str:
    """Every word of a file once: enough for what is one word, and much shorter."""
    return "\n".join(set(re.findall(r"\w+", all_words(name, text))))


def hits(word: str, name: str, text: str) -> list[str]:
    """Places of a word in a file, in its name too."""
    pattern = re.compile(rf"\b(?:{word})\b", re.I)
    if not pattern.search((all_words if " " in word else different_words)(name, text)):
        return []
    lines = [name, *text.splitlines()]
    found = [
        f"{name}:{number}: {line.strip()}"
        for number, line in enumerate(lines)
        if pattern.search(cleaned := PHRASES.sub("", line)) or pattern.search(split_names(cleaned))
    ]
    return found


@pytest.mark.parametrize("word", RETIRED)
def test_word_stays_away(word):
    found = [
        hit
        for name, text in TEXTS.items()
        if not any(name.startswith(place) and word in words for place, words in ALLOWED.items())
        for hit in hits(word, name, text)
    ]
    assert not found, f"say `{RETIRED[word]}` instead:\n" + "\n".join(found)


def test_a_word_is_found_in_text_and_in_names():
    assert hits(r"told", "a.py", "as_told = 1\nclass ToldLaw\nUnless TOLD otherwise\ntolder\n") == [
        "a.py:1: as_told = 1",
        "a.py:2: class ToldLaw",
        "a.py:3: Unless TOLD otherwise",
    ]
    assert hits(r"rungs?", "the_rung.py", "") == ["the_rung.py:0: the_rung.py"]
    assert not hits(r"drawn", "a.py", "charge drawn from the battery")
