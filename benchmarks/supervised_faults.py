"""Thruster faults under supervision: which vehicles go on, which say that they cannot.

    python benchmarks/supervised_faults.py [single] [pairs] [alarms] [--seeds N] [--hours H]

Vehicles keep station in waves (0.5 m, 5 s) and a current of 0.36 m/s, on an observer of their own sensors, at 100 Hz,
with preset robust and `supervisor: true`. Faults begin after 20 s of 60 s and last.

single: every thruster off, at half its thrust, stuck at the input of the onset, reversed. Recovered: the rms of the
    position error from 10 to 20 s after the onset is below twice that of the same time without a fault. Announced: a
    lost axis is a reason of the supervisor within 1 s of the onset.
pairs: both of every pair of thrusters of ODIN off at once. Recovered as above, from 20 to 40 s after the onset; or the
    supervisor is SAFE or STOPPED at the end.
alarms: transitions without any fault, per simulated hour, as well with the parameters of another publication.
"""

import argparse
import itertools
import time
from collections import Counter
from typing import Any

import numpy as np

from soak.judged_runs import Judged, judged_runs
from undertow.core.status import Status

ONSET, WINDOW, WINDOWS = 20.0, 10.0, 6  # s
T200 = {"kind": "t200", "supply": 16}
VEHICLES: dict[str, tuple[Any, int]] = {
    "bluerov2_heavy": (T200, 8),
    "bluerov2": (T200, 6),
    "odin": ({"kind": "paper_table3", "supply": 24, "fidelity": "shaft"}, 8),
}
SENSORS = [
    "imu",
    {"kind": "dvl", "period": 0.125, "noise": 0.005, "delay": 0.05},
    "depth",
    "compass",
    {"kind": "position_fix", "period": 1, "noise": 0.05, "delay": 0.2},
]
KINDS = ("off", "scale", "stuck", "reversed")
NEVER = 1e6  # s


def scenario(vehicle: str, faults: list[dict[str, Any]], seed: int, duration: float = WINDOW * WINDOWS, **changes: Any):
    """A supervised vehicle at sea."""
    return {
        "plant": {"vehicle": vehicle, "thruster": VEHICLES[vehicle][0]},
        "model": {"rate_term": True},
        "controller": {"kind": "rcaf", "preset": "robust"},
        "supervisor": True,
        "reference": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5]},
        "disturbance": [{"kind": "current", "velocity": [0.3, 0.2, 0]}, {"kind": "waves", "height": 0.5, "period": 5}],
        "navigation": {"kind": "observer", "sensors": SENSORS},
        "loop": {"dt": 0.01, "duration": duration, "record": 1.0},
        "faults": faults,
        "seed": seed,
    } | changes


def error(one: Judged, first: int, last: int) -> float:
    """Position error, m, rms over windows."""
    squares = (one.rms()[first:last, :3] ** 2).sum(1)
    return float(np.sqrt(squares.mean())) if one.status is Status.OK else float("inf")


def entry(thruster: int, mode: str, onset: float = ONSET) -> dict[str, Any]:
    """A fault of a thruster; `scale` leaves half of the input."""
    return {"target": f"thruster {thruster}", "mode": mode, "onset": onset} | (
        {"severity": 0.5} if mode == "scale" else {}
    )


def found_after(one: Judged) -> float:
    """Time from the onset to the first transition for a lost thruster, s; infinite without one."""
    times = [change.time - ONSET for change in one.transitions if change.reason == "thruster_lost"]
    return min(times, default=float("inf"))


def announced(one: Judged) -> bool:
    """Whether a lost axis was announced within a second, or the vehicle is SAFE or STOPPED at the end."""
    lost = any(0 <= change.time - ONSET <= 1.0 for change in one.transitions if change.reason == "axes_lost")
    return lost or one.state in ("SAFE", "STOPPED")


def single(seeds: int) -> None:
    """Every thruster, every kind of fault."""
    print(f"{'vehicle':16}{'fault':10}{'runs':>6}{'recovered':>11}{'or announced':>14}{'found after, s (median)':>25}")
    for (vehicle, (_, count)), mode in itertools.product(VEHICLES.items(), KINDS):
        healthy = judged_runs([scenario(vehicle, [entry(1, mode, NEVER)], seed) for seed in range(seeds)], WINDOWS)
        cases = [(thruster, seed) for thruster in range(1, count + 1) for seed in range(seeds)]
        runs = judged_runs([scenario(vehicle, [entry(k, mode)], seed) for k, seed in cases], WINDOWS)
        well = [error(one, 3, 4) < 2 * error(healthy[seed], 3, 4) for one, (_, seed) in zip(runs, cases, strict=True)]
        or_said = [good or announced(one) for good, one in zip(well, runs, strict=True)]
        median = np.median([found_after(one) for one in runs])
        print(f"{vehicle:16}{mode:10}{len(runs):6}{sum(well):11}{sum(or_said):14}{median:25.2f}", flush=True)


def pairs(seeds: int) -> None:
    """All pairs of thrusters of ODIN."""
    several = list(itertools.combinations(range(1, 9), 2))
    cases = [(pair, seed) for pair in several for seed in range(seeds)]
    runs = judged_runs([scenario("odin", [entry(k, "off") for k in pair], seed) for pair, seed in cases], WINDOWS)
    never = [[entry(1, "off", NEVER), entry(2, "off", NEVER)]] * seeds
    healthy = judged_runs([scenario("odin", faults, seed) for seed, faults in enumerate(never)], WINDOWS)
    ends: dict[tuple[int, int], list[str]] = {}
    for (pair, seed), one in zip(cases, runs, strict=True):
        well = error(one, 4, 6) < 2 * error(healthy[seed], 4, 6)
        said = "recovered" if well else one.state if announced(one) else "NEITHER"
        ends.setdefault(pair, []).append(said)
    for pair, each in ends.items():
        print(f"thrusters {pair[0]} and {pair[1]}: {', '.join(f'{word} {n}' for word, n in Counter(each).items())}")
    print("all:", dict(Counter(itertools.chain(*ends.values()))))


def alarms(hours: float) -> None:
    """Transitions of vehicles without faults."""
    moves = {"station": {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5]}, "lissajous": {"kind": "lissajous"}}
    models = {
        "right": {"rate_term": True},
        "wu2018": {"rate_term": True, "vehicle": {"kind": "bluerov2_heavy", "parameters": "wu2018"}},
    }
    each = 3600.0
    for (move, reference), (name, model) in itertools.product(moves.items(), models.items()):
        count = max(1, round(hours * 3600 / each))
        several = [
            scenario("bluerov2_heavy", [], seed, each, reference=reference, model=model) for seed in range(count)
        ]
        runs = judged_runs(several, 1)
        reasons = Counter(change.reason for one in runs for change in one.transitions if change.reason)
        print(f"{move}, model {name}: {count * each / 3600:g} h, {dict(reasons) or 'no transition'}", flush=True)


def main() -> None:
    """Print the parts that are asked for; all without arguments."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "parts", nargs="*", choices=["single", "pairs", "alarms", []], default=["single", "pairs", "alarms"]
    )
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--hours", type=float, default=25.0)
    given = parser.parse_args()
    for part in given.parts:
        began = time.monotonic()
        {"single": single, "pairs": pairs}[part](given.seeds) if part != "alarms" else alarms(given.hours)
        print(f"{part}: {time.monotonic() - began:.0f} s\n", flush=True)


if __name__ == "__main__":
    main()
