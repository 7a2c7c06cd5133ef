"""Negative controls: the unprotected law of the paper, which must fail in ten known ways.

A harness in which these do not fail would not see failures. Each control is run beside the same scenario without what
makes it fail, which must succeed, and both are judged by the same criterion.
"""

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from soak.judged_runs import Judged, judged_runs
from soak.verdict import Failure
from undertow.core.errors import BadInput
from undertow.core.status import Status

_UNPROTECTED = str(Path(__file__).with_name("unprotected.py"))

# A control fails if its run does not reach its end, is refused, or has in the last quarter this many times the tracking
# error, or at any time this many times the weights, of the run beside it; below these sizes nothing counts.
_WORSE = 3.0
_SMALL_ERROR, _SMALL_WEIGHTS = 0.02, 20.0  # m or rad; m/s^2 or rad/s^2

_WINDOWS = 4

Scenario = dict[str, Any]


class Control(NamedTuple):
    """A way in which the unprotected law fails.

    Attributes:
        identity: D1 to D10, as in the list of failure modes.
        says: what fails, and why.
        failing: the scenario.
        beside: the same without what makes it fail.
    """

    identity: str
    says: str
    failing: Scenario
    beside: Scenario


class Controls(NamedTuple):
    """Result of the controls: a row of each, those that did not fail as failures of the harness, elapsed time, s."""

    rows: list[dict[str, Any]]
    failures: list[Failure]
    seconds: float


_LOOP: Scenario = {"kind": "sampled", "duration": 20.0, "dt": 1e-3, "record": 1.0}
_SMALL_LOAD = {"kind": "random_suite", "amplitude": 0.3, "step": 0.3}
_GOAL = {"kind": "setpoint", "position": [2.0, 3.0, 4.0, 1.047, 0.785, 1.257]}


def _axes(**changes: Any) -> Scenario:
    """Six axes x_ddot = u + d, which a law with an exact model makes of any vehicle with ideal thrusters."""
    found: Scenario = {
        "plant": {"kind": "double_integrator", "axes": 6},
        "controller": {"kind": "rcaf", "preset": "paper"},
        "reference": {"kind": "setpoint", "position": [0.0] * 6},
        "loop": _LOOP,
    }
    return found | changes


def _odin(lag: float, **changes: Any) -> Scenario:
    """ODIN with thrusters of 17.1 N/V that follow the voltage with a lag, s, under suite U1."""
    thruster = {"kind": "first_order", "thrust_per_volt": 17.107, "time_constant": lag}
    found: Scenario = {
        "plant": {"vehicle": "odin", "thruster": thruster},
        "controller": {"kind": "rcaf", "preset": "paper"},
        "reference": _GOAL,
        "disturbance": "u1",
        "loop": _LOOP,
    }
    return found | changes


def _rov(vehicle: str) -> Scenario:
    goal = {"kind": "setpoint", "position": [1.0, 1.0, 1.0, 0.0, 0.5, 0.5]}
    controller = {"kind": "rcaf", "preset": "paper"}
    return {
        "plant": {"vehicle": vehicle, "thruster": "t200"},
        "controller": controller,
        "reference": goal,
        "loop": _LOOP,
    }


def _with_sensor(fidelity: str) -> Scenario:
    plant = {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": fidelity}}
    return _odin(0.0, plant=plant, model={"speed_sensor": True})


_PUSHED: Scenario = {"plant": {"kind": "double_integrator", "axes": 6, "limit": 1.5}}
_PUSHED |= {"reference": {"kind": "setpoint", "position": [2.0] * 6}}
_FED = {"kind": "rcaf", "preset": "paper", "identification_input": "commanded"}
_NARROW = {"fuzzy_input": "state", "reach": [0.05, 0.05]}
_DRIFTING = {"kind": "rcaf", "preset": "paper", "sets": 3, "reach": [0.1]}
_FAR = {"initial": {"position": [2.0] * 6}}
_NOISE = {"kind": "white_noise", "velocity": 0.01}
_LONG = _LOOP | {"duration": 600.0}

CONTROLS = (
    Control(
        "D1",
        "Weights drift in velocity noise of 1 cm/s until the loop diverges.",
        _axes(controller=_DRIFTING, disturbance=_SMALL_LOAD, navigation=_NOISE, loop=_LONG),
        _axes(controller=_DRIFTING, disturbance=_SMALL_LOAD, loop=_LONG),
    ),
    Control("D2", "A lag of the thrusters of 10 ms makes the weights drift.", _odin(0.01), _odin(0.001)),
    Control(
        "D3",
        "With the commanded input in its model the estimate winds up where the input is limited.",
        _axes(**_PUSHED, controller=_FED),
        _axes(**_PUSHED),
    ),
    Control(
        "D4",
        "A sampling time of 10 ms makes the weights drift.",
        _axes(disturbance="u1", loop=_LOOP | {"dt": 0.01}),
        _axes(disturbance="u1"),
    ),
    Control(
        "D5",
        "Far from every fuzzy set the printed quotient of Gaussians is 0/0, and so is the command.",
        _axes(**_FAR, controller={"kind": f"{_UNPROTECTED}:plain_basis", **_NARROW}),
        _axes(**_FAR, controller={"kind": "rcaf", "preset": "paper", **_NARROW}),
    ),
    Control(
        "D6",
        "Six thrusters of rank 5 cannot hold a pitch that the law does not know to be unattainable.",
        _rov("bluerov2"),
        _rov("bluerov2_heavy"),
    ),
    Control(
        "D7",
        "At a pitch of 90 degrees Euler angles are undefined.",
        _odin(0.001, reference={"kind": "setpoint", "position": [0.0, 0.0, 0.0, 0.0, 1.5708, 0.0]}),
        _odin(0.001, reference={"kind": "setpoint", "position": [0.0, 0.0, 0.0, 0.0, 0.785, 0.0]}),
    ),
    Control(
        "D8",
        "A velocity that is wrong by 5 m/s for 10 ms fills the weights.",
        _axes(navigation={"kind": f"{_UNPROTECTED}:glitch"}),
        _axes(navigation={"kind": f"{_UNPROTECTED}:glitch", "size": 0.0}),
    ),
    Control(
        "D9",
        "Measurements that are 10 ms late make the loop unstable.",
        _axes(disturbance="u1", navigation={"kind": "degraded", "delay": 0.01}),
        _axes(disturbance="u1", navigation={"kind": "degraded", "delay": 0.001}),
    ),
    Control(
        "D10",
        "With a speed sensor on a shaft with inertia the law is an algebraic loop, which undertow refuses to build.",
        _with_sensor("shaft"),
        _with_sensor("ideal"),
    ),
)


def run_controls(
    short: bool = False, until: float = float("inf"), watch: Callable[[int], None] = lambda done: None
) -> Controls:
    """Run the controls, and judge each beside its scenario without what makes it fail.

    Args:
        short: only those that take a second.
        until: time of `time.monotonic` after which no further control begins.
        watch: called with the number of controls that are done.
    """
    began, rows, failures = time.monotonic(), [], []
    for number, control in enumerate(_SHORT if short else CONTROLS):
        if time.monotonic() > until:
            break
        row = judged_control(control)
        rows.append(row)
        if not row["fails"] or not row["beside_succeeds"]:
            what = "did not fail" if row["beside_succeeds"] else f"cannot be compared: {row['beside']}"
            failures.append(Failure("N4", f"controls/{control.identity}", f"the control {what}: {row['found']}"))
        watch(number + 1)
    return Controls(rows, failures, time.monotonic() - began)


def judged_control(control: Control) -> dict[str, Any]:
    """A row: whether a control fails as it must, how, and whether the run beside it succeeds."""
    failing, beside = _ended(control.failing), _ended(control.beside)
    words = (_words(failing), _words(beside))
    row: Mapping[str, Any] = {"identity": control.identity, "says": control.says, "found": words[0], "beside": words[1]}
    succeeds = isinstance(beside, Judged) and beside.status is Status.OK and not beside.events()
    return {**row, "fails": _fails(failing, beside), "beside_succeeds": succeeds}


def _ended(scenario: Scenario) -> Judged | str:
    """The run of a scenario, or why there is none."""
    try:
        return judged_runs([scenario], _WINDOWS)[0]
    except BadInput as error:
        return str(error)


def _fails(one: Judged | str, beside: Judged | str) -> bool:
    if isinstance(one, str):
        return "algebraic loop" in one
    if isinstance(beside, str) or one.status is not Status.OK or one.events():
        return True
    error, usual = _error(one), _error(beside)
    weights, usual_weights = float(one.counts.weights.max()), float(beside.counts.weights.max())
    return error > max(_WORSE * usual, _SMALL_ERROR) or weights > max(_WORSE * usual_weights, _SMALL_WEIGHTS)


def _error(one: Judged) -> float:
    """Largest rms of an axis in the last window, m or rad."""
    return float(one.rms()[-1].max())


def _words(one: Judged | str) -> str:
    if isinstance(one, str):
        return f"refused: {one}"
    events = "".join(f"; {event}: {says}" for event, says in one.events())
    size = f"error {_error(one):.3g}, weights {one.counts.weights.max():.3g}"
    return f"{one.status.word} at {one.ended:.4g} s; {size}{events}"


_SHORT = tuple(control for control in CONTROLS if control.identity in ("D5", "D8", "D9", "D10"))
