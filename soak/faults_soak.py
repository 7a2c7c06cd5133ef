"""Runs with random faults under supervision: whatever fails, an input that is not allowed never reaches the plant."""

import dataclasses
import inspect
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np

from soak.judged_runs import Judged, judge, judged_runs, watched
from soak.verdict import Failure
from undertow.core import catalogue, runtime
from undertow.core.numerics.random_keys import key_of_seed
from undertow.physics.faults.injected import InputFault
from undertow.physics.faults.kinds import FaultKind, list_kinds
from undertow.physics.faults.occurrence import Occurrence
from undertow.physics.faults.sampling import random_fault
from undertow.physics.faults.targets import targets_of
from undertow.scenario.build import build
from undertow.simulation.loop.loop_runs import LoopRun
from undertow.simulation.prepared_run import PreparedRun

# Of so many runs one is repeated by itself, built from its scenario, and so many at most.
_REPEATED, _MOST_REPEATED = 40, 25
_PAIRS = 0.2  # share of runs with two faults
_DURATION = 20.0  # s
_NEVER = 1e6  # s, onset of the faults of a program that a run does not have; each has another, by which it is found

# Loops that are given faults; under supervision, at 50 Hz.
LOOPS: dict[str, dict[str, Any]] = {
    "BlueROV2 Heavy, robust law": {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
        "model": {"rate_term": True},
        "controller": {"kind": "rcaf", "preset": "robust"},
        "navigation": {"kind": "white_noise", "position": 0.005, "velocity": 0.01},
    },
    "ODIN, PID, its own sensors": {
        "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "static", "supply": 24}},
        "controller": {"kind": "pid"},
        "navigation": {"kind": "observer"},
    },
}
_COMMON: dict[str, Any] = {
    "supervisor": True,
    "reference": {"kind": "setpoint", "position": [1.0, 0.5, 0.5, 0.0, 0.0, 0.3], "settling": 8},
    "disturbance": {"kind": "current", "velocity": [0.2, 0.1, 0.0]},
    "loop": {"kind": "sampled", "dt": 0.02, "duration": _DURATION, "record": 1.0},
}


class Faulted(NamedTuple):
    """Result of runs with faults.

    Attributes:
        number: runs.
        endings: runs by how they ended.
        states: runs by the state of the supervisor at their end.
        modes: faults by target and mode, such as `thruster off`.
        programs: how many were compiled.
        repeated: runs that were repeated.
        failures: never-events.
        seconds: elapsed time.
    """

    number: int
    endings: dict[str, int]
    states: dict[str, int]
    modes: dict[str, int]
    programs: int
    repeated: int
    failures: list[Failure]
    seconds: float


class FaultProgram(NamedTuple):
    """One loop with every kind of fault of one target: runs differ in the one or two that occur.

    Attributes:
        loop: name of the loop.
        kinds: of its faults.
        width: thrusters or inputs to choose from.
    """

    loop: str
    kinds: tuple[FaultKind, ...]
    width: int

    def scenario(self, faults: Mapping[int, Mapping[str, Any]], seed: int) -> dict[str, Any]:
        """The scenario of a run with faults, by their places among the kinds."""
        never = (self._entry(index) for index in range(len(self.kinds)))
        entries = [{**entry, **faults.get(index, {})} for index, entry in enumerate(never)]
        return LOOPS[self.loop] | _COMMON | {"faults": entries, "seed": seed}

    def _entry(self, index: int) -> dict[str, Any]:
        kind = self.kinds[index]
        target = f"{kind.target} 1" if kind.target in _NUMBERED else kind.target
        announced = {"announced": True} if kind.can_be_announced and index % 3 == 0 else {}
        return {"target": target, "mode": kind.mode, "onset": _NEVER + index} | announced

    def sample(self, chance: np.random.Generator) -> dict[int, dict[str, Any]]:
        """Random faults of a run by their places: one, or two."""
        count = 2 if len(self.kinds) > 1 and chance.uniform() < _PAIRS else 1
        faults = {}
        for index in map(int, chance.choice(len(self.kinds), count, replace=False)):
            entry = random_fault(chance, self.kinds[index], self.width, _DURATION)
            entry.pop("announced", None)  # that, and the length of a delay line, belong to the program
            if "longest" in inspect.signature(catalogue.find("faults", entry["mode"])).parameters:
                entry.pop("severity", None)
            faults[index] = entry
        return faults


_NUMBERED = ("thruster", "input")


def programs() -> list[FaultProgram]:
    """Programs with all kinds of faults of all loops."""
    fault_programs = []
    for name, loop in LOOPS.items():
        built = build({**loop, **_COMMON, "supervisor": None}).closed_loop
        for target in targets_of(built.plant, built.navigation).values():
            fault_programs.append(FaultProgram(name, tuple(list_kinds([target])), target.width))
    return fault_programs


class Sampled(NamedTuple):
    """A run: its program, its faults by their places, and its seed."""

    program: int
    faults: dict[int, dict[str, Any]]
    seed: int


def sampled(number: int, seed: int, all_programs: Sequence[FaultProgram]) -> list[Sampled]:
    """So many runs with random faults, spread over programs in proportion to their kinds."""
    shares = np.array([len(program.kinds) for program in all_programs], dtype=float)
    samples = []
    for i in range(number):
        chance = np.random.default_rng([seed, 20, i])
        program_index = int(chance.choice(len(all_programs), p=shares / shares.sum()))
        samples.append(Sampled(program_index, all_programs[program_index].sample(chance), i))
    return samples


def run_faulted(
    number: int, seed: int, until: float = float("inf"), watch: Callable[[int, int], None] = lambda done, failed: None
) -> Faulted:
    """Run loops with random faults, judge each run for never-events, and repeat some of them.

    Args:
        number: of runs.
        seed: of all of them.
        until: time of `time.monotonic` after which no further program begins.
        watch: called with the numbers of runs and of failures so far.
    """
    began = time.monotonic()
    all_programs = programs()
    runs = sampled(number, seed, all_programs)
    endings: Counter[str] = Counter()
    states: Counter[str] = Counter()
    modes: Counter[str] = Counter()
    failures: list[Failure] = []
    done = compiled = repeated = 0
    for index, program in enumerate(all_programs):
        runs_of_program = [run for run in runs if run.program == index]
        if not runs_of_program or time.monotonic() > until:
            continue
        judged = judge(runs_with_faults(program, runs_of_program), watch=partial(_shown, watch, done, len(failures)))
        for run, judged_run in zip(runs_of_program, judged, strict=True):
            failures += [Failure(event, f"faults/{seed}/{run.seed}", message) for event, message in judged_run.events()]
            endings[judged_run.status.word] += 1
            states[judged_run.state] += 1
            modes.update(f"{program.kinds[k].target} {program.kinds[k].mode}" for k in run.faults)
        repeats = runs_of_program[: _MOST_REPEATED * _REPEATED : _REPEATED]
        failures += _other_bytes(
            program, repeats, dict(zip((run.seed for run in runs_of_program), judged, strict=True)), seed
        )
        done += len(runs_of_program)
        compiled += 1
        repeated += len(repeats)
        watch(done, len(failures))
    seconds = time.monotonic() - began
    return Faulted(done, dict(endings), dict(states), dict(modes), compiled, repeated, failures, seconds)


def _shown(watch: Callable[[int, int], None], before: int, failed: int, done: int) -> None:
    watch(before + done, failed)


def runs_with_faults(program: FaultProgram, runs: Sequence[Sampled]) -> list[PreparedRun]:
    """The runs of a program, which is built once; the numbers of their faults are then set in its parts."""
    prepared = watched(build(program.scenario({}, 0)), windows=1)
    with runtime.in_precision(prepared.precision):
        return [prepared._replace(run=_with_faults(prepared.run, sample)) for sample in runs]


def _with_faults(run: LoopRun, sampled: Sampled) -> LoopRun:
    entries = {_NEVER + index: entry for index, entry in sampled.faults.items()}

    def changed(part: Any) -> Any:
        if isinstance(part, Occurrence):
            entry = entries.get(float(part.onset[0]))
            return part if entry is None else _occurrence_with(part, entry)
        if isinstance(part, InputFault):
            entry = entries.get(float(part.occurrence.onset[0]))
            return part if entry is None else _input_fault_with(part, entry)
        return part

    with_faults = jax.tree.map(changed, run, is_leaf=lambda part: isinstance(part, Occurrence | InputFault))
    return with_faults._replace(key=key_of_seed(sampled.seed))


def _occurrence_with(occurrence: Occurrence, entry: Mapping[str, Any]) -> Occurrence:
    numbers = {name: entry[name] for name in ("onset", "duration", "severity") if name in entry}
    arrays = {name: np.full_like(getattr(occurrence, name), number) for name, number in numbers.items()}
    return dataclasses.replace(occurrence, **arrays)


def _input_fault_with(fault: InputFault, entry: Mapping[str, Any]) -> InputFault:
    fault = dataclasses.replace(fault, occurrence=_occurrence_with(fault.occurrence, entry))
    name, _, number = entry["target"].partition(" ")
    if name not in _NUMBERED:
        return fault
    return dataclasses.replace(fault, chosen=np.eye(fault.chosen.shape[0])[int(number) - 1])


def _other_bytes(
    program: FaultProgram, runs: Sequence[Sampled], judged: Mapping[int, Judged], seed: int
) -> list[Failure]:
    """N6: runs whose bytes differ when they are built from their scenarios and run in the opposite order."""
    runs = runs[::-1]
    repeated_runs = judged_runs([program.scenario(run.faults, run.seed) for run in runs])
    pairs = [
        (run, repeated)
        for run, repeated in zip(runs, repeated_runs, strict=True)
        if repeated.digest != judged[run.seed].digest
    ]
    return [
        Failure(
            "N6",
            f"faults/{seed}/{run.seed}",
            f"digest {judged[run.seed].digest}, and {repeated.digest} when it was repeated",
        )
        for run, repeated in pairs
    ]


def replay(identity: str) -> tuple[dict[str, Any], Judged]:
    """Scenario and run of an identity once more: `faults/SEED/NUMBER`."""
    _, seed, number = identity.split("/")
    all_programs = programs()
    run = sampled(int(number) + 1, int(seed), all_programs)[-1]
    scenario = all_programs[run.program].scenario(run.faults, run.seed)
    return scenario, judged_runs([scenario])[0]
