"""How fast a memory unlearns: the vehicle or the water changes after four laps, or the knowledge is of another vehicle.

BlueROV2 Heavy (parameters vonbenzon2022) with the model wu2018, T200s at 16 V, still water, 50 Hz, preset `learning`
against `robust` at the same gains. In the case "inertia too high" the model is exact, and what is known is 2.5 times
its inertia. The ratios of the rms errors are those of the last lap before the change and of each
quarter of a lap after it. `above` is the time after the change for which the error of a quarter lap is above 1.1 times
that of `robust`, counted up to the last such quarter.

    python benchmarks/learning_changes.py [--motions lissajous,six_axis] [--laws rules,linear] [--cases all]
        [--probing 0]
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any

import jax
import numpy as np
from learning import LAWS, PROBING, motions, run_seeds, set_probing
from learning_tasks import built

jax.config.update("jax_enable_x64", True)

BEFORE, AFTER, QUARTERS = 4, 3, 4
# Cases of knowledge that is wrong -> model of the law that loads it.
FOREIGN = {"other model": "wu2018", "signs turned": "wu2018", "inertia too high": "vonbenzon2022"}


def changes(time: float) -> dict[str, dict[str, Any]]:
    """Entries of a scenario for each change at a time, s."""
    current, drag = (
        {"target": "plant", "mode": mode, "severity": s} for mode, s in (("current_step", 0.2), ("drag", 1.0))
    )
    until, then = {"onset": 0, "duration": time}, {"onset": time}
    weak = {"target": "thruster 2", "mode": "scale", "severity": 0.5}
    return {
        "payload": {"disturbance": [{"kind": "payload", "mass": 1.5, "weight": 8.0, "start": time}]},
        "thruster at half": {"faults": [weak | then]},
        "drag doubles": {"faults": [drag | then]},
        "drag halves": {"faults": [drag | until]},
        "current turns": {"faults": [current | until, current | then | {"direction": [-1.0, 0.0, 0.0]}]},
    }


def model(parameters: str) -> dict[str, Any]:
    """Entries of a scenario for a nominal model."""
    return {"model": {"vehicle": {"parameters": parameters}}}


def foreign(path: Path, motion: str, law: str, case: str, lap: float) -> None:
    """Write knowledge that is wrong: see `FOREIGN`. With signs turned, all weights and inertias are."""
    learnt_with = "px4" if case == "other model" else FOREIGN[case]
    loop = built(LAWS[law], 50, model(learnt_with), motion)
    final = run_seeds(loop, 50, np.round(BEFORE * lap), [0], 0.0, np.inf).final
    sign = -1.0 if case == "signs turned" else 1.0
    knowledge = {"weights": sign * final["memory_weights"][0], "variance": final["memory_variance"][0]}
    if "inertia" in final:
        h = np.full_like(final["inertia"][0], 2.5) if case == "inertia too high" else final["inertia"][0] ** sign
        knowledge["inertia"] = h
    np.savez(path, **knowledge)


def ratios(motion: str, law: str, case: str) -> tuple[np.ndarray, np.ndarray]:
    """Ratios of position and attitude error to `robust`: last lap before the change, and quarters of laps after it."""
    lap = motions()[motion][1]
    time, part = BEFORE * lap, lap / QUARTERS
    found = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "learnt.npz"
        wrong = case in FOREIGN
        if wrong:
            foreign(path, motion, law, case, lap)
        for one in ("robust", law):
            known = {"knowledge": str(path)} if wrong and one != "robust" else {}
            before = 0 if wrong else BEFORE
            loop = built(LAWS[one] | known, 50, model(FOREIGN[case]) if wrong else changes(time)[case], motion)
            stop = (before + AFTER) * lap
            found.append(run_seeds(loop, 50, np.ceil(stop), [0], 0.0, stop, part).laps[0])
    robust, other = (one**2 for one in found)
    start = before * QUARTERS
    lapped = (
        np.sqrt(other[start - QUARTERS : start].sum(0) / robust[start - QUARTERS : start].sum(0)) if start else None
    )
    return (np.full(2, np.nan) if lapped is None else lapped), np.sqrt(other / robust)[start:]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motions", default="lissajous,six_axis")
    parser.add_argument("--laws", default="both,linear")
    parser.add_argument("--cases", default="all")
    parser.add_argument("--probing", type=float, help=PROBING)
    chosen = parser.parse_args()
    set_probing(chosen)
    cases = [*changes(0.0), *FOREIGN] if chosen.cases == "all" else chosen.cases.split(",")
    for motion in chosen.motions.split(","):
        part = motions()[motion][1] / QUARTERS
        for case in cases:
            for law in chosen.laws.split(","):
                lapped, after = ratios(motion, law, case)
                for place, name in enumerate(("position", "attitude")):
                    worse = np.flatnonzero(after[:, place] > 1.1)
                    above = part * (worse[-1] + 1) if worse.size else 0.0
                    print(
                        f"{motion:<10}{case:<18}{law:<8}{name:<9} before {lapped[place]:5.2f}  after"
                        + "".join(f"{one:6.2f}" for one in after[:, place])
                        + f"   above {above:5.0f} s",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
