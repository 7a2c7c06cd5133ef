"""Tasks for which a memory was not made: preset `learning` against `robust`, whole runs from the first second.

BlueROV2 Heavy (parameters vonbenzon2022) with the model wu2018 unless the task says otherwise, T200s at 16 V. All laws
have the gains of preset `robust`. Errors are rms over the whole run, medians over seeds, so that the time in which the
memory learns counts. A ratio above 1.1 is marked.

    python benchmarks/learning_tasks.py [--seeds 6] [--first 3000] [--rates 50] [--tasks all] [--laws rules,linear]
        [--probing 0]
"""

import argparse
import copy
from typing import Any

import equinox as eqx
import jax
import numpy as np
from learning import LAWS, PROBING, motions, run_seeds, set_probing

from undertow.core.contracts import AbstractReference
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.simulation.loop.closed_loop import ClosedLoop

jax.config.update("jax_enable_x64", True)

HELD = {"kind": "setpoint", "position": [0.0] * 6}
WAVES = {"kind": "waves", "height": 0.25, "depth": 3.0}
CURRENT = {"kind": "current", "velocity": [0.15, 0.1, 0.0]}
# Task -> reference, duration (s) and what differs from the base scenario; a name is one of `motions`.
TASKS: dict[str, tuple[Any, float, dict[str, Any]]] = {
    "station in waves": (HELD, 180.0, {"disturbance": [CURRENT, WAVES]}),
    "current step": (
        HELD,
        180.0,
        {"faults": [{"target": "plant", "mode": "current_step", "severity": 0.3, "onset": 60}]},
    ),
    "lawn mower": ("lawn_mower", 180.0, {}),
    "pitch through 90 deg": (
        {"kind": "sine", "amplitude": [0.0, 0.0, 0.0, 0.0, 2.0, 0.0], "frequency": 0.5},
        180.0,
        {},
    ),
    "payload": ("lissajous", 252.0, {"disturbance": [{"kind": "payload", "mass": 1.5, "weight": 8.0, "start": 126.0}]}),
    "dead thruster": ("lissajous", 252.0, {"faults": [{"target": "thruster 2", "mode": "off", "onset": 126}]}),
    "wrong model": ("lissajous", 126.0, {"model": {"vehicle": {"parameters": "px4"}}}),
    "noise": ("lissajous", 126.0, {"navigation": {"kind": "degraded", "position_noise": 0.01, "velocity_noise": 0.02}}),
    "delay": ("lissajous", 126.0, {"navigation": {"kind": "degraded", "delay": 0.1}}),
    "low battery": ("lissajous", 126.0, {"plant": {"thruster": {"supply": 12.0}}}),
    "tether": (
        "lawn_mower",
        180.0,
        {"disturbance": [{"kind": "tether", "anchor": [0.0, 0.0, -3.0], "length": 6.0, "stiffness": 10.0}]},
    ),
    "underactuated": (
        "lissajous",
        126.0,
        {
            "plant": {"vehicle": {"kind": "bluerov2", "parameters": "hkpolyu"}},
            "model": {"vehicle": {"kind": "bluerov2", "parameters": "li2020"}},
        },
    ),
    "drag doubles": (
        "lissajous",
        252.0,
        {"faults": [{"target": "plant", "mode": "drag", "severity": 1.0, "onset": 126}]},
    ),
}


def merged(base: dict[str, Any], change: dict[str, Any]) -> dict[str, Any]:
    """`base` with the entries of `change`, tables within tables."""
    found = copy.deepcopy(base)
    for key, value in change.items():
        inner = isinstance(value, dict) and isinstance(found.get(key), dict)
        found[key] = merged(found[key], value) if inner else value
    return found


def built(law: dict[str, Any], rate: int, change: dict[str, Any], reference: Any) -> ClosedLoop:
    """Closed loop of the base scenario with changes.

    Args:
        law: options of the controller.
        rate: control steps per second.
        change: what differs from the base scenario.
        reference: of a scenario, an object, or the name of one of `motions`.
    """
    base = {
        "plant": {
            "vehicle": {"kind": "bluerov2_heavy", "parameters": "vonbenzon2022"},
            "thruster": {"kind": "t200", "supply": 16.0},
            "ledger": False,
        },
        "model": {"rate_term": True, "vehicle": {"kind": "bluerov2_heavy", "parameters": "wu2018"}},
        "controller": {"kind": "rcaf"} | law,
        "reference": reference if isinstance(reference, dict) else HELD,
        "loop": {"dt": 1 / rate, "duration": 1.0, "record": 0.1},
    }
    loop = build(from_data(merged(base, change))).closed_loop
    moving = motions()[reference][0] if isinstance(reference, str) else reference
    return eqx.tree_at(lambda one: one.reference, loop, moving) if isinstance(moving, AbstractReference) else loop


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--first", type=int, default=3000)
    parser.add_argument("--rates", default="50")
    parser.add_argument("--tasks", default="all")
    parser.add_argument("--laws", default="both,linear")
    parser.add_argument("--probing", type=float, help=PROBING)
    chosen = parser.parse_args()
    set_probing(chosen)
    print(f"{'task':<22}{'Hz':>4}  {'law':<8}{'position':>12}{'attitude':>14}{'variation':>12}   ratios to robust")
    for rate in map(int, chosen.rates.split(",")):
        for task in TASKS if chosen.tasks == "all" else chosen.tasks.split(","):
            base = None
            for name in ("robust", *chosen.laws.split(",")):
                reference, duration, change = TASKS[task]
                loop = built(LAWS[name], rate, change, reference)
                seeds = range(chosen.first, chosen.first + chosen.seeds)
                found = run_seeds(loop, rate, duration, seeds, 0.0, duration)
                base = found.errors if base is None else base
                ratio = np.median(found.errors / base, axis=0)
                value = np.median(found.errors, axis=0)
                print(
                    f"{task:<22}{rate:>4}  {name:<8}{1e3 * value[0]:9.1f} mm{1e3 * value[1]:9.1f} mrad"
                    f"{value[2]:8.2f} V/s   "
                    + "".join(f"{one:6.2f}" for one in ratio)
                    + (f"  {found.lost} lost" if found.lost else "")
                    + ("  WORSE" if (ratio[:2] > 1.1).any() else ""),
                    flush=True,
                )


if __name__ == "__main__":
    main()
