"""Thruster faults in closed loop: recovery, pairs, detection and false alarms, with and without the wrapper.

    python benchmarks/thruster_faults.py [single] [pairs] [detection] [false_alarms] [cost] [--seeds N]

Vehicles keep station or move in waves (0.5 m, 5 s) and current (0.3, 0.2 m/s), on an observer of their own sensors
at 100 Hz, as in examples/bluerov2_heavy.yaml. ODIN has the thruster of the paper with a supply of 24 V.

single: off, half, stuck at the voltage of the onset, reversed; every thruster. Recovered: the rms of the position
    error 10 to 20 s after the onset is below twice that of the same run without it.
pairs: every pair of thrusters of ODIN off at once.
detection: thruster off while its nominal thrust exceeds 20 % of the largest one; references and onsets at random. Of
    all onsets, and of those after which the same run without a fault goes on with more than 20 % for half a second.
false_alarms: alarms without a fault, per simulated hour.
cost: a control step of preset robust with and without the wrapper.
"""

import argparse
import itertools
import time
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.control.supervision.fault_tolerant_law import FaultTolerantController, fault_tolerant
from undertow.core import runtime
from undertow.core.contracts import AbstractController, AbstractFaults, Target
from undertow.core.measurement import measurement_of_outputs
from undertow.core.param import Param, param
from undertow.core.signals import Signal
from undertow.scenario.build import Built, build
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.loop_runs import RunPlan
from undertow.simulation.loop.simd_batch import kept_step
from undertow.simulation.prepared_run import prepare_loop
from undertow.simulation.run_many import run_together

DT, ONSET, DURATION = 0.01, 20.0, 40.0  # s
KINDS = {"off": (0.0, 0.0), "half": (0.5, 0.0), "stuck": (0.0, 1.0), "reversed": (-1.0, 0.0)}  # scale, held share
SENSORS = [
    "imu",
    {"kind": "dvl", "period": 0.125, "noise": 0.005, "delay": 0.05},
    "depth",
    "compass",
    {"kind": "position_fix", "period": 1, "noise": 0.05, "delay": 0.2},
]
T200, T500 = {"kind": "t200", "supply": 16}, {"kind": "t500"}
VEHICLES = {
    "bluerov2_heavy": T200,
    "bluerov2": T200,
    "odin": {"kind": "paper_table3", "supply": 24, "fidelity": "shaft"},
}


class InputFault(AbstractFaults):
    """Actuators whose input becomes scale times the applied one, plus a share of that of the onset."""

    failing: Float[Param, " m"] = param("", "1 for an actuator that fails, else 0")
    scale: Float[Param, ""] = param("", "share of the input that remains")
    held: Float[Param, ""] = param("", "share of the input of the onset")
    onset: Float[Param, ""] = param("s", "when they fail")

    def realize(self, key):
        return ()

    def init(self, realization, y, u):
        return jnp.zeros_like(u)

    def measurement(self, realization, state, t, y):
        return y, state

    def input(self, realization, state, t, u, limits):
        kept = jnp.where(t < self.onset, u, state)
        failed = (t >= self.onset) & (self.failing > 0)
        return jnp.where(failed, self.scale * u + self.held * kept, u), kept

    def load(self, realization, t, pose, load):
        return load

    def active(self, realization, t) -> Array:
        return (t >= self.onset).astype(int) * (self.failing > 0).sum().astype(int)

    def jumps(self, duration: float):
        return (float(self.onset),)


def scenario(vehicle: str, law: str = "robust", reference: Any = None, **changes: Any) -> Built:
    """A vehicle at sea; `changes` replace whole keys."""
    station = {"kind": "setpoint", "position": [2, 1, 1, 0, 0, 0.5]}
    given = {
        "plant": {"kind": "hybrid_vehicle", "vehicle": vehicle, "thruster": VEHICLES[vehicle]},
        "model": {"rate_term": True},
        "controller": {"kind": "rcaf", "preset": "robust"} if law == "robust" else {"kind": law},
        "reference": reference or station,
        "disturbance": [{"kind": "current", "velocity": [0.3, 0.2, 0]}, {"kind": "waves", "height": 0.5, "period": 5}],
        "navigation": {"kind": "observer", "sensors": SENSORS},
        "loop": {"dt": DT, "duration": 20, "record": 0.05},
    }
    return build(given | changes)


def batch(loops: list[ClosedLoop], seeds: list[int], duration: float, signals: tuple[str, ...], every: int = 5):
    """Recorded signals of many runs of one kind, with a leading axis over runs."""
    plan = RunPlan(round(duration / DT), DT, every, signals)
    return run_together([prepare_loop(loop, plan, seed) for loop, seed in zip(loops, seeds, strict=True)]).signals


def loop_with(built: Built, law: Any, fault: InputFault) -> ClosedLoop:
    """The loop of a scenario with another law and a fault."""
    loop = built.closed_loop
    return ClosedLoop(loop.plant, law, loop.reference, loop.disturbance, loop.navigation, fault)


def laws_of(built: Built) -> dict[str, Any]:
    """The law by itself and with the wrapper."""
    law = built.closed_loop.controller
    return {"alone": law, "tolerant": fault_tolerant(law, DT)}


def fault(count: int, failing: tuple[int, ...], kind: str = "off", onset: float = ONSET) -> InputFault:
    """Fault of given thrusters, numbered from 0."""
    return InputFault(np.isin(np.arange(count), failing).astype(float), *KINDS[kind], onset)


def recovery(built: Built, faults: list[tuple[str, tuple[int, ...]]], seeds: int) -> dict[str, dict[str, np.ndarray]]:
    """Of each law, arrays over (faults, seeds): relative error, largest error, detection and announcement times."""
    count, found = built.closed_loop.plant.inputs(), {}
    cases = [("off", ()), *faults]
    for name, law in laws_of(built).items():
        signals = ("error",) + (("lost_thrusters", "lost_axes") if name == "tolerant" else ())
        loops = [loop_with(built, law, fault(count, case, kind)) for kind, case in cases for _ in range(seeds)]
        outcome = batch(loops, list(range(seeds)) * len(cases), DURATION, signals)
        rows = {key: np.asarray(value).reshape(len(cases), seeds, *value.shape[1:]) for key, value in outcome.items()}
        time_of = np.arange(rows["error"].shape[2]) * 5 * DT - ONSET
        size = np.linalg.norm(rows["error"][..., :3], axis=-1)
        rms = np.sqrt((size[..., time_of >= 10] ** 2).mean(-1))
        found[name] = {"ratio": rms[1:] / rms[:1], "largest": size[1:, :, time_of >= 0].max(-1), "nominal": rms[0]}
        if name == "tolerant":
            lost, axes = rows["lost_thrusters"] > 0, rows["lost_axes"].any(-1)
            when = lambda flags, time_of=time_of: np.where(flags.any(-1), time_of[flags.argmax(-1)], np.inf)
            demand = np.array([np.isin(np.arange(count), case) for _, case in faults])[:, None]
            found[name] |= {
                "detected": np.max(np.where(demand, when(np.moveaxis(lost[1:], -2, -1)), -np.inf), axis=-1),
                "wrong": (lost[1:, :, -1] & ~demand).any(-1),
                "announced": when(axes[1:]),
            }
    return found


def single(seeds: int) -> None:
    print("Single faults. Recovered or the lost axis announced within 1 s, of all runs; median detection time.")
    for vehicle in VEHICLES:
        for law in ("robust", "pid"):
            built = scenario(vehicle, law)
            count = built.closed_loop.plant.inputs()
            faults = [(kind, (i,)) for kind in KINDS for i in range(count)]
            found = recovery(built, faults, seeds)
            for kind in KINDS:
                chosen = [i for i, (name, _) in enumerate(faults) if name == kind]
                part = lambda row, chosen=chosen: {k: v if k == "nominal" else v[chosen] for k, v in row.items()}
                one, two = (part(found[name]) for name in ("alone", "tolerant"))
                fine = (two["ratio"] < 2) | (two["announced"] <= 1)
                seen = np.isfinite(two["detected"])
                median = np.median(two["detected"][seen]) if seen.any() else np.nan
                print(
                    f"  {vehicle:<15}{law:<7}{kind:<9} alone {np.mean(one['ratio'] < 2):4.0%} "
                    f"(largest error {one['largest'].max():5.2f} m)  tolerant {fine.mean():4.0%} "
                    f"(recovered {np.mean(two['ratio'] < 2):4.0%}, largest error {two['largest'].max():5.2f} m, "
                    f"detected {seen.mean():4.0%}, median {median:.2f} s, wrong {two['wrong'].mean():3.0%}); "
                    f"nominal {1e3 * two['nominal'].mean():.0f} mm",
                    flush=True,
                )


def pairs(seeds: int) -> None:
    print("Pairs of ODIN, off at once: recovered, or axes announced; of 28.")
    built = scenario("odin")
    both = list(itertools.combinations(range(8), 2))
    found = recovery(built, [("off", pair) for pair in both], seeds)
    one, two = found["alone"], found["tolerant"]
    recovered, announced = two["ratio"] < 2, np.isfinite(two["announced"])
    for pair, back, said, seen, wrong in zip(both, recovered, announced, two["detected"], two["wrong"], strict=True):
        words = (
            f"recovered {back.mean():4.0%}, announced {said.mean():4.0%}, both found {np.isfinite(seen).mean():4.0%}"
        )
        print(f"  {pair[0] + 1} and {pair[1] + 1}: {words}, wrong {wrong.mean():4.0%}")
    print(f"  all: alone {np.mean(one['ratio'] < 2):.0%}; tolerant {np.mean(recovered | announced):.0%}", flush=True)


MOVES = {
    "station": ((0.0, 0.0, 0.0, 0.0), (0.2, 0.2, 0.2, 0.2)),  # amplitudes of north, east, down, yaw, and rad/s
    "slow": ((2.0, 1.0, 0.5, 0.3), (0.1, 0.2, 0.1, 0.1)),
    "brisk": ((2.0, 1.0, 0.5, 0.5), (0.3, 0.45, 0.25, 0.4)),
    "fast": ((2.0, 1.0, 0.5, 0.6), (0.6, 0.8, 0.5, 0.8)),
}


def moving(built: Built, law: Any, which: InputFault, chance: np.random.Generator, moves: str) -> ClosedLoop:
    """A loop whose Lissajous reference has the amplitudes and frequencies of a kind of move, within a factor."""
    amplitude, frequency = (np.array(value) for value in MOVES[moves])
    factor = lambda: jnp.asarray(np.exp(chance.uniform(-0.3, 0.3, 4)))
    chosen = amplitude * factor(), frequency * factor()
    phases = lambda loop: (loop.reference.amplitude, loop.reference.frequency, loop.reference.phase)
    phase = jnp.asarray(chance.uniform(0, 2 * np.pi, 4))
    return eqx.tree_at(phases, loop_with(built, law, which), (*chosen, phase))


LOSSES = ("lost_thrusters", "nominal_forces")


class Watched(AbstractController):
    """A fault-tolerant law that also records the nominal forces of the applied inputs."""

    own: FaultTolerantController

    @property
    def model(self):  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.own.model

    def init(self, y, r):
        return self.own.init(y, r)

    def command(self, z, y, r):
        u, signals = self.own.command(z, y, r)
        return u, signals | {"nominal_forces": z.monitor.forces[0]}

    def advance(self, z, y, r, u_applied, dt):
        return self.own.advance(z, y, r, u_applied, dt)

    def known_acceleration(self, z, y, u_applied):
        return self.own.known_acceleration(z, y, u_applied)

    def signals(self):
        return self.own.signals() | {"nominal_forces": Signal(("actuator",), "N", "nominal force")}


def detection(seeds: int) -> None:
    print("Thruster off while its nominal thrust exceeds 20 % of the largest one: right, and no other, within 0.5 s.")
    whole = np.zeros(6, dtype=int)
    for vehicle in VEHICLES:
        for moves in MOVES:
            chance = np.random.default_rng(1)
            built = scenario(vehicle, reference={"kind": "lissajous"})
            law = Watched(fault_tolerant(built.closed_loop.controller, DT))
            count, runs = built.closed_loop.plant.inputs(), 64 * seeds
            failing = np.arange(runs) % count
            onsets = chance.uniform(8.0, 16.0, runs)
            loops = [
                moving(built, law, fault(count, (int(i),), "off", float(at)), chance, moves)
                for i, at in zip(failing, onsets, strict=True)
            ]
            without = [eqx.tree_at(lambda loop: loop.faults.onset, loop, jnp.asarray(1e6)) for loop in loops]
            found, healthy = (batch(several, list(range(runs)), 18.0, LOSSES, every=1) for several in (loops, without))
            at = np.arange(found["lost_thrusters"].shape[1]) * DT
            force = (
                np.abs(healthy["nominal_forces"])[np.arange(runs), :, failing] / law.own.monitor.largest[failing, None]
            )
            lost = found["lost_thrusters"] > 0
            early = at[None, :, None] < onsets[:, None, None]
            before = (lost & early).any((1, 2))
            soon = (at[None, :] >= onsets[:, None]) & (at[None, :] <= onsets[:, None] + 0.5)
            right = (lost[np.arange(runs), :, failing] & soon).any(-1)
            others = lost.copy()
            others[np.arange(runs), :, failing] = False
            wrong = (others & soon[..., None]).any((1, 2))
            counted = (force[np.arange(runs), np.searchsorted(at, onsets)] > 0.2) & ~before
            goes_on = counted & (force > 0.2).all(-1, where=soon)
            good = right & ~wrong
            each = (counted, counted & good, goes_on, goes_on & good, counted & wrong, before)
            tally = np.array([one.sum() for one in each])
            whole += tally
            print(
                f"  {vehicle:<15}{moves:<9}{tally[1]:4d} of {tally[0]:4d}, with thrust that goes on {tally[3]:4d} of "
                f"{tally[2]:4d}; {tally[4]} wrong; {tally[5]} of {runs} runs with an alarm before the fault",
                flush=True,
            )
    share = lambda part, of: f"{part} of {of} ({part / max(of, 1):.1%})"
    print(
        f"  all: {share(whole[1], whole[0])}, with thrust that goes on {share(whole[3], whole[2])}, wrong {whole[4]}, "
        f"before {whole[5]}"
    )


def false_alarms(seeds: int) -> None:
    print("False alarms, without a fault: runs with an alarm, and alarms per 100 simulated hours.")
    wrong_model = {"rate_term": True, "vehicle": {"kind": "bluerov2_heavy", "parameters": "wu2018"}}
    cases = [(vehicle, moves, {}) for vehicle in VEHICLES for moves in MOVES]
    cases += [("bluerov2_heavy", moves, {"model": wrong_model}) for moves in MOVES]
    cases += [
        ("bluerov2_heavy", moves, {"navigation": {"kind": "white_noise", "position": 0.01, "velocity": 0.01}})
        for moves in MOVES
    ]
    still = {"navigation": "perfect", "disturbance": [{"kind": "current", "velocity": [0.3, 0.2, 0]}]}
    cases += [("bluerov2_heavy", moves, still | changes) for changes in ({}, {"model": wrong_model}) for moves in MOVES]
    duration, runs = 225.0, 16 * seeds
    hours = runs * duration / 3600
    for vehicle, moves, changes in cases:
        chance = np.random.default_rng(2)
        built = scenario(vehicle, reference={"kind": "lissajous"}, **changes)
        law = fault_tolerant(built.closed_loop.controller, DT)
        count = built.closed_loop.plant.inputs()
        loops = [moving(built, law, fault(count, ()), chance, moves) for _ in range(runs)]
        lost = batch(loops, list(range(runs)), duration, ("lost_thrusters", "fault_evidence"), every=100)
        alarms = (lost["lost_thrusters"][:, -1] > 0).sum()
        what = f"{vehicle} {' '.join(changes)}"
        print(f"  {what:<50}{moves:<9}{alarms:4d} in {hours:.1f} h: {100 * alarms / hours:6.1f} per 100 h", flush=True)


def cost(seeds: int) -> None:
    print("A control step (command, all signals, advance) as the autopilot takes it, without its checks of numbers.")
    built = scenario("bluerov2_heavy")
    start, target = np.zeros(6), Target(np.array([2.0, 1, 1, 0, 0, 0.5]), np.zeros(6), np.zeros(6))
    steps = {}
    for name, law in laws_of(built).items():
        numbers, rest = eqx.partition(law, eqx.is_array)

        def step(numbers, z, given, rest=rest):
            law, y = eqx.combine(numbers, rest), measurement_of_outputs(*given)
            u, signals = law.command(z, y, target)
            return law.advance(z, y, target, jnp.clip(u, -16.0, 16.0), jnp.asarray(DT)), (u, signals)

        z = law.init(measurement_of_outputs(start, start), target)
        steps[name] = kept_step(step, numbers, jax.tree.map(np.asarray, z), (start, start))
    chance, times = np.random.default_rng(0), {name: [] for name in [*steps, "one lost"]}
    for block in range(200):
        for name, one in steps.items():
            lost = name == "tolerant" and block >= 100
            if lost:
                one.state.monitor.findings.lost[2] = 1.0
            taken = np.empty(200)
            for k in range(200):
                for place, value in zip(one.inputs, 0.1 * chance.normal(size=(2, 6)), strict=True):
                    place[...] = value
                before = time.perf_counter_ns()
                one()
                taken[k] = time.perf_counter_ns() - before
            times["one lost" if lost else name].append(np.median(taken) / 1e3)
    alone = np.median(times["alone"])
    for name, one in times.items():
        print(f"  {name:<10}{np.median(one):7.2f} us  {np.median(one) / alone - 1:+.1%}")


SECTIONS = {"single": single, "pairs": pairs, "detection": detection, "false_alarms": false_alarms, "cost": cost}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sections", nargs="*")
    parser.add_argument("--seeds", type=int, default=4)
    given = parser.parse_args()
    for name in given.sections or SECTIONS:
        begun = time.perf_counter()
        with runtime.in_precision("float64"):
            SECTIONS[name](given.seeds)
        print(f"  ({time.perf_counter() - begun:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
