"""What hostile inputs found in undertow, each as the file or command line that did it: now one line, and nothing left."""

import pytest

from soak import plug_ins, specimens
from soak.command import attacked
from soak.input_runner import try_in_process
from soak.inputs import BUILD, Attack
from soak.verdict import failure_of
from undertow.core.errors import BadInput, printable

pytestmark = pytest.mark.soak

LAW = "return pid(model, frequency=frequency)"


def plugged(code):
    return {"mine.py": code.encode(), "s.yaml": specimens.PLUGGED.encode()}


def table(data):
    return {**specimens.scenario_files(specimens.SCENARIOS["recorded"]), "d.csv": data}


OWN = plug_ins._OWN.replace("{init}", "return jnp.zeros(1)").replace("{advance}", "return z")
LONG = "k" * 1000
REST = "reference: {kind: setpoint, position: [0]}\n"

FOUND = {
    "control characters of a table": (table(b"t,d1\n0,1\n1,\x1b[31m\x07\n"), (BUILD, "s.yaml"), r"\x1b[31m\x07"),
    "control characters of a log": ({"log.csv": b"time_ms,x\x00\x1b\n0,1\n1,2\n"}, ("logs", "log.csv"), "must"),
    "exit in a function": (
        plugged(specimens.PLUG_IN.replace(LAW, "raise SystemExit(2)")),
        ("check", "s.yaml"),
        "cannot run `law`: SystemExit: 2 (mine.py, line 7)",
    ),
    "an exception that is none of Exception": (
        plugged("raise BaseException('base')\n" + specimens.PLUG_IN),
        ("check", "s.yaml"),
        "BaseException: base (mine.py, line 1)",
    ),
    "an exception whose message raises": (
        plugged(
            "class E(Exception):\n    def __str__(self): raise ValueError('in str')\nraise E\n" + specimens.PLUG_IN
        ),
        ("check", "s.yaml"),
        "E: its message cannot be read (mine.py, line 3)",
    ),
    "an object of a class that no statement defines": (
        plugged(specimens.PLUG_IN.replace(LAW, "return type('X', (), {})()")),
        (BUILD, "s.yaml"),
        "which returns a `X` (mine.py)",
    ),
    "declarations of signals that are none": (
        plugged(OWN.format(signals="None", command="return jnp.zeros(1), {}")),
        ("check", "s.yaml"),
        "`Mine.signals` must return a mapping of names to `Signal`, but returns None",
    ),
    "a declaration that is no Signal": (
        plugged(OWN.format(signals="{'x': 3}", command="return jnp.zeros(1), {'x': 3}")),
        (BUILD, "s.yaml"),
        "`Mine.signals` must return a mapping of names to `Signal`, but returns {'x': 3}",
    ),
    "signals that are no mapping": (
        plugged(OWN.format(signals="{}", command="return jnp.zeros(1), 3")),
        (BUILD, "s.yaml"),
        "`Mine.command` must return its signals as a mapping, {} for none, but returns a int",
    ),
    "a key of thousands of characters": (
        {"s.yaml": f"plant: {{kind: double_integrator, {LONG}: 1, l{LONG}: 2, m{LONG}: 3}}\n{REST}".encode()},
        (BUILD, "s.yaml"),
        "kkk...",
    ),
    "a word of thousands of characters": ({}, ("a" * 3000,), "aaa..."),
    "the root of the disk as results folder": (
        specimens.scenario_files(specimens.SCENARIOS["axis"]),
        ("simulate", "s.yaml", "--out", "/"),
        "`--out` must be a folder inside another one",
    ),
}


@pytest.mark.parametrize("name", FOUND)
def test_what_was_found_is_refused_in_one_line(name, tmp_path):
    files, words, said = FOUND[name]
    done = try_in_process(attacked, Attack("", files, words), tmp_path)
    assert done.code == 2 and said in done.err, done
    assert failure_of("", words, files, done._replace(seconds=(0.0, 0.0))) is None


def test_printable_text_is_one_line_that_any_terminal_shows():
    assert printable("a\n b\tc") == "a b c"
    assert printable("\x1b[31m\u202e\ud800") == r"\x1b[31m\u202e\ud800"
    assert printable("5 \u03bcm, 30 \u00b0") == "5 \u03bcm, 30 \u00b0"
    assert str(BadInput("a", "be b", "\x07")) == r"`a` must be b, but is \x07"
