"""The paper's next study in numbers: observer-based, non-affine and large-scale control.

Prints every number of docs/explanation/next-study.md and its three parts. Runs are those of the batch compiler, one
seed each; errors are rms per axis over the window that is named.

    python benchmarks/next_study.py [observer] [thrust] [pair] [--long]

`--long` runs the main cases of each part for 2,000 s and compares windows of it.
"""

import argparse
import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from undertow.analysis.metrics import accumulators, results
from undertow.analysis.observer_limit import LinearLaw, papers_law, slowest_observer
from undertow.control.controllers.rcaf import rcaf
from undertow.physics.plants.double_integrator import double_integrator
from undertow.scenario.build import build
from undertow.scenario.reading import from_data, read
from undertow.simulation.loop import simd_batch

jax.config.update("jax_enable_x64", True)

EXAMPLES = Path(__file__).parents[1] / "examples"
WINDOWS = ((10.0, 20.0), (100.0, 200.0), (1000.0, 2000.0))  # s, of the long runs

PAPER = {"kind": "rcaf", "preset": "paper", "weights_bound": 20.0}
ROBUST, ADRC, PID = {"kind": "rcaf", "preset": "robust"}, {"kind": "adrc"}, {"kind": "pid"}
# Table 1 is faster than a motor: alpha_F, gamma_eps and a robust term that a motor of 0.1 s allows, found by trial.
SLOWED = PAPER | {"pole": 10.0, "composite": 0.5, "robust_gain": 0.2}


class Found(NamedTuple):
    """A run: whether it reached its end, when it ended (s), metrics of each window, and recorded signals."""

    completed: bool
    ended: float
    windows: list[dict[str, Any]]
    signals: Mapping[str, np.ndarray]


def example(name: str) -> dict[str, Any]:
    """Content of a scenario file."""
    return dict(read(EXAMPLES / f"{name}.yaml").data)


def changed(scenario: Mapping[str, Any], **changes: Any) -> dict[str, Any]:
    """A scenario with other parts; those of a mapping are merged into the one that is there."""
    found = copy.deepcopy(dict(scenario))
    for key, value in changes.items():
        merge = isinstance(value, Mapping) and isinstance(found.get(key), Mapping) and "kind" not in value
        found[key] = {**found[key], **value} if merge else value
    return found


def run(scenario: Mapping[str, Any], windows: Sequence[tuple[float, float]] = ()) -> Found:
    """Run a scenario; without windows, its second half counts."""
    built = build(from_data(scenario))
    loop, plant = built.scenario.loop, built.closed_loop.plant
    windows = windows or ((loop.duration / 2, loop.duration),)
    gathered = [accumulators(plant, (), *window) for window in windows]
    outcome = simd_batch.simulate(
        built.closed_loop,
        duration=loop.duration,
        dt=loop.dt,
        substeps=loop.substeps,
        position=built.scenario.initial.position,
        record_every=round(loop.record / loop.dt),
        accumulators=tuple(one for each in gathered for one in each),
    )
    metrics = [results(each, outcome.accumulated[i : i + 1]) for i, each in enumerate(gathered)]
    return Found(int(outcome.status) == 0, float(outcome.ended), metrics, outcome.signals)


def shown(label: str, found: Found) -> None:
    """Print a line for each window of a run."""
    for i, metrics in enumerate(found.windows):
        if not found.completed:
            print(f"{label:<52} left the envelope at {found.ended:.1f} s", flush=True)
            return
        sizes = f"{1e3 * metrics['position_rms']:10.3f} mm{1e3 * metrics['attitude_rms']:10.3f} mrad"
        effort = f"{metrics['input_variation']:11.1f} V/s"
        estimate = f"{metrics.get('position_estimation_rms', np.nan):8.3f} m/s^2"
        print(f"{label if i == 0 else '':<52}{sizes}{effort}  d_hat - d {estimate}", flush=True)


def pose_only(bandwidth: float, noise: float, order: int = 3) -> dict[str, Any]:
    """Navigation from the pose."""
    return {"kind": "pose_only", "bandwidth": bandwidth, "noise": noise, "order": order}


def observer(long: bool) -> None:
    """Velocities not measured: ODIN, fidelity static, suite U2, 1 kHz."""
    print("\nOBSERVER-BASED: slowest observer with which a law is stable at small errors, rad/s (order 2, order 3)")
    model = double_integrator(1).model()
    for composite in (500.0, 20.0, 5.0):
        law = papers_law(rcaf(model, preset="paper", composite=composite))
        limits = [f"{slowest_observer(law, order):8.1f}" for order in (2, 3)]
        print(f"  paper, gamma_eps {composite:5.0f}: w_d {law.frequency:6.1f} rad/s", *limits)
    for share in (0.25, 0.5):
        law = LinearLaw(2.0, 1.0, (share**2, 2 * share))
        limits = [f"{slowest_observer(law, order):8.2f} w_d" for order in (2, 3)]
        print(f"  robust and adrc, tracking {share} w_d:", *limits)

    settled = {"dt": 0.001, "duration": 60.0, "record": 0.1}
    base = changed(example("observer_based"), loop=settled, plant={"ledger": False})
    slower, perfect = PAPER | {"composite": 20.0}, {"kind": "perfect"}
    print("\nOBSERVER-BASED: 30 to 60 s of U2; a law beside its observer has half the bandwidth of that unless Table 1")
    for name, law in (("paper", PAPER), ("paper, gamma_eps 20", slower), ("robust", ROBUST), ("adrc", ADRC)):
        shown(f"{name}, velocity measured", run(changed(base, controller=law, navigation=perfect)))
    for noise in (0.0, 1e-4, 1e-3, 1e-2):
        for order, speeds in ((3, (25.0, 50.0, 100.0, 200.0, 400.0)), (2, (50.0, 100.0))):
            for w in speeds:
                own = {"bandwidth": w / 2}
                for name, law in (
                    ("paper", PAPER),
                    ("gamma_eps 20", slower),
                    ("robust", ROBUST | own),
                    ("adrc", ADRC | own),
                ):
                    if order == 3 or name == "robust":
                        label = f"{name}, w {w:.0f} rad/s, order {order}, noise {1e3 * noise:g} mm"
                        shown(label, run(changed(base, controller=law, navigation=pose_only(w, noise, order))))
    if long:
        print("\nOBSERVER-BASED: 2,000 s of U2, noise 1 mm and 1 mrad; windows 10-20, 100-200, 1000-2000 s")
        base = changed(base, loop={"duration": 2000.0, "record": 1.0})
        unbounded = slower | {"weights_bound": float("inf")}
        for name, law, seen in (
            ("gamma_eps 20, |theta| <= 20, w 100 rad/s", slower, pose_only(100.0, 1e-3)),
            ("gamma_eps 20, weights unbounded, w 100 rad/s", unbounded, pose_only(100.0, 1e-3)),
            ("the same, noise 0.1 mm and 0.1 mrad", unbounded, pose_only(100.0, 1e-4)),
            ("the same, no noise", unbounded, pose_only(100.0, 0.0)),
            ("gamma_eps 20, weights unbounded, v measured", unbounded, perfect),
            ("robust, w 50 rad/s", ROBUST | {"bandwidth": 25.0}, pose_only(50.0, 1e-3)),
            ("adrc, w 50 rad/s", ADRC | {"bandwidth": 25.0}, pose_only(50.0, 1e-3)),
        ):
            found = run(changed(base, controller=law, navigation=seen), WINDOWS)
            peaks = [metrics.get("position_weights_peak", np.nan) for metrics in found.windows]
            shown(name, found)
            print(f"{'':<52}largest weight in the windows", " ".join(f"{peak:.2f}" for peak in peaks), "m/s^2")


def thrust(long: bool) -> None:
    """Thrust not affine in the voltage: BlueROV2 Heavy, T200s with inflow."""
    base = changed(example("non_affine"), plant={"ledger": False}, loop={"record": 0.1})
    rest = {"kind": "setpoint", "position": [0.0] * 6}
    sway = [{"kind": "sinusoid", "amplitude": [0.05] * 3 + [0.1] * 3, "frequency": 0.3}]
    motions = {"lissajous": {}, "hold": {"reference": rest, "disturbance": sway}}
    for motion, changes in motions.items():
        print(f"\nNON-AFFINE: {motion}, 30 to 60 s, 500 Hz")
        for zone in ("subtract", "pass"):
            for fidelity in ("ideal", "static", "shaft", "electromechanical"):
                thruster = {"kind": "t200", "fidelity": fidelity, "supply": 16.0, "dead_zone_kind": zone}
                substeps = 10 if fidelity == "electromechanical" else 1
                case = changed(base, plant={"thruster": thruster}, loop={"substeps": substeps}, **changes)
                laws = [("paper", PAPER, True), ("paper solved", PAPER, False)]
                if fidelity not in ("ideal", "static"):
                    laws += [("slowed", SLOWED, True), ("slowed solved", SLOWED, False)]
                for name, law, affine in (*laws, ("robust", ROBUST, True), ("adrc", ADRC, True)):
                    found = run(changed(case, controller=law, model={"affine": affine}))
                    shown(f"{zone}, {fidelity}, {name}", found)
        print(f"\nNON-AFFINE: {motion}, thruster axial_flow, 30 to 60 s, 200 Hz")
        case = changed(base, plant={"thruster": {"kind": "axial_flow"}}, loop={"dt": 0.005}, **changes)
        for name, law, affine in (("slowed", SLOWED, True), ("slowed solved", SLOWED, False), ("robust", ROBUST, True)):
            shown(name, run(changed(case, controller=law, model={"affine": affine})))
    if long:
        print("\nNON-AFFINE: lissajous, 2,000 s; windows 10-20, 100-200, 1000-2000 s")
        for fidelity, law in (("static", PAPER), ("shaft", SLOWED)):
            thruster = {"kind": "t200", "fidelity": fidelity, "supply": 16.0, "dead_zone_kind": "subtract"}
            case = changed(base, plant={"thruster": thruster}, loop={"duration": 2000.0, "record": 1.0}, controller=law)
            for affine in (True, False):
                found = run(changed(case, model={"affine": affine}), WINDOWS)
                shown(f"subtract, {fidelity}, {'affine' if affine else 'solved'}", found)


def pair(long: bool) -> None:
    """Two vehicles with a link: a law in each."""
    base = changed(example("large_scale"), loop={"record": 0.1})
    laws = {"robust": ROBUST, "adrc": ADRC, "pid": PID}
    links = [("none", 50.0, 10.0), ("tether", 50.0, 10.0), ("tether", 500.0, 50.0)]
    print("\nLARGE-SCALE: T200 shaft, 100 Hz, 30 to 60 s; the first vehicle moves, the second keeps its station")
    for link, stiffness, damping in links:
        for name, law in laws.items():
            each(f"{link} {stiffness:g} N/m, {name}", run(linked(base, link, stiffness, damping, law)))
    print(
        "\nLARGE-SCALE: T200 static with a subtracted dead zone, 500 Hz, the same motion; the paper's law solves for V"
    )
    steady = {"kind": "t200", "fidelity": "static", "supply": 16.0, "dead_zone_kind": "subtract"}
    known = {"affine": False, "rate_term": False}
    fast = changed(base, plant={"thruster": steady}, model=known, loop={"dt": 0.002})
    for link, stiffness, damping in links:
        for name, law in {"paper": PAPER, "robust": ROBUST, "adrc": ADRC}.items():
            each(f"{link} {stiffness:g} N/m, {name}", run(linked(fast, link, stiffness, damping, law)))
    print("\nLARGE-SCALE: T200 shaft, 100 Hz, 30 to 60 s; both move alike and carry the bar under opposite loads")
    load = {"kind": "sinusoid", "amplitude": [0.3, 0.3, 0.1, 0.0, 0.0, 0.0, -0.3, -0.3, -0.1, 0.0, 0.0, 0.0]}
    alike = changed(
        base,
        reference={"amplitude": [0.4, 0.6, 0.2, 0.0, 0.0, 0.0] * 2, "frequency": [0.5, 0.3, 0.4, 0.0, 0.0, 0.0] * 2},
        disturbance=load,
    )
    for link, stiffness, damping in (("none", 50.0, 10.0), ("bar", 500.0, 50.0), ("bar", 5000.0, 200.0)):
        for name, law in laws.items():
            each(f"{link} {stiffness:g} N/m, {name}", run(linked(alike, link, stiffness, damping, law)))
    if long:
        print("\nLARGE-SCALE: 2,000 s; windows 10-20, 100-200, 1000-2000 s")
        slow = {"duration": 2000.0, "record": 1.0}
        for name in ("robust", "adrc", "pid"):
            found = run(linked(changed(base, loop=slow), "tether", 50.0, 10.0, laws[name]), WINDOWS)
            each(f"tether 50 N/m, {name}", found)
        found = run(linked(changed(fast, loop=slow), "tether", 50.0, 10.0, PAPER), WINDOWS)
        each("tether 50 N/m, paper, static", found)


def linked(scenario: Mapping[str, Any], link: str, stiffness: float, damping: float, law: Any) -> dict[str, Any]:
    """The scenario with a link, and a law in each vehicle."""
    options = {"link": link, "stiffness": stiffness, "damping": damping}
    return changed(scenario, plant=options, controller={"kind": "decentralised", "law": law})


def each(label: str, found: Found) -> None:
    """Print the errors of both vehicles, and the largest tension."""
    if not found.completed:
        print(f"{label:<32} left the envelope at {found.ended:.1f} s", flush=True)
        return
    tension, share = found.signals["tension"], found.windows[0]["saturated_fraction"]
    for metrics in found.windows:
        off = np.asarray(metrics["error_rms_axes"]).reshape(4, 3)
        first, turn, second, other = 1e3 * np.sqrt((off**2).mean(1))
        print(
            f"{label:<32} first {first:8.3f} mm {turn:8.3f} mrad, second {second:8.3f} mm {other:8.3f} mrad, "
            f"{metrics['input_variation']:7.1f} V/s; tension {tension.min():7.1f} to {tension.max():6.1f} N, "
            f"at limits {100 * share:4.1f} %",
            flush=True,
        )


PARTS = {"observer": observer, "thrust": thrust, "pair": pair}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", help="observer, thrust, pair; all of them unless given")
    parser.add_argument("--long", action="store_true")
    chosen = parser.parse_args()
    for part in chosen.parts or PARTS:
        if part not in PARTS:
            parser.error(f"parts must be among {', '.join(PARTS)}, got {part}")
        PARTS[part](chosen.long)
