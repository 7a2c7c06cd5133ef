"""Runs with random faults under supervision: whatever fails, an input that is not allowed never reaches the plant."""

import inspect
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from undertow.core import catalogue
from undertow.faults.kinds import Kind, list_kinds
from undertow.faults.sampling import random_fault
from undertow.faults.targets import targets_of
from undertow.numerics.random_keys import key_of_seed
from undertow.scenario.build import build
from undertow.soak.judged_runs import Group, Judged, judged_groups, judged_runs, prepared
from undertow.soak.verdict import Failure

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


class Program(NamedTuple):
    """One loop with every kind of fault of one target: runs differ in the one or two that occur.

    Attributes:
        loop: name of the loop.
        kinds: of its faults.
        width: thrusters or inputs to choose from.
    """

    loop: str
    kinds: tuple[Kind, ...]
    width: int

    def scenario(self, faults: Mapping[int, Mapping[str, Any]], seed: int) -> dict[str, Any]:
        """The scenario of a run with faults, by their places among the kinds."""
        never = (self._entry(place) for place in range(len(self.kinds)))
        entries = [{**entry, **faults.get(place, {})} for place, entry in enumerate(never)]
        return LOOPS[self.loop] | _COMMON | {"faults": entries, "seed": seed}

    def _entry(self, place: int) -> dict[str, Any]:
        kind = self.kinds[place]
        target = f"{kind.target} 1" if kind.target in _NUMBERED else kind.target
        announced = {"announced": True} if kind.can_be_announced and place % 3 == 0 else {}
        return {"target": target, "mode": kind.mode, "onset": _NEVER + place} | announced

    def sample(self, chance: np.random.Generator) -> dict[int, dict[str, Any]]:
        """Random faults of a run by their places: one, or two."""
        count = 2 if len(self.kinds) > 1 and chance.uniform() < _PAIRS else 1
        found = {}
        for place in map(int, chance.choice(len(self.kinds), count, replace=False)):
            entry = random_fault(chance, self.kinds[place], self.width, _DURATION)
            entry.pop("announced", None)  # that, and the length of a delay line, belong to the program
            if "longest" in inspect.signature(catalogue.find("faults", entry["mode"])).parameters:
                entry.pop("severity", None)
            found[place] = entry
        return found


_NUMBERED = ("thruster", "input")


def programs() -> list[Program]:
    """Programs with all kinds of faults of all loops."""
    found = []
    for name, loop in LOOPS.items():
        built = build({**loop, **_COMMON, "supervisor": None}).closed_loop
        for target in targets_of(built.plant, built.navigation).values():
            found.append(Program(name, tuple(list_kinds([target])), target.width))
    return found


class Sampled(NamedTuple):
    """A run: its program, its faults by their places, and its seed."""

    program: int
    faults: dict[int, dict[str, Any]]
    seed: int


def sampled(number: int, seed: int, several: Sequence[Program]) -> list[Sampled]:
    """So many runs with random faults, spread over programs in proportion to their kinds."""
    shares = np.array([len(one.kinds) for one in several], dtype=float)
    found = []
    for i in range(number):
        chance = np.random.default_rng([seed, 20, i])
        which = int(chance.choice(len(several), p=shares / shares.sum()))
        found.append(Sampled(which, several[which].sample(chance), i))
    return found


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
    began, several = time.monotonic(), programs()
    runs = sampled(number, seed, several)
    endings: Counter[str] = Counter()
    states: Counter[str] = Counter()
    modes: Counter[str] = Counter()
    failures: list[Failure] = []
    done = compiled = repeated = 0
    for place, program in enumerate(several):
        own = [run for run in runs if run.program == place]
        if not own or time.monotonic() > until:
            continue
        found = judged_groups([group(program, own)], watch=partial(_shown, watch, done, len(failures)))
        for run, one in zip(own, found, strict=True):
            failures += [Failure(event, f"faults/{seed}/{run.seed}", says) for event, says in one.events()]
            endings[one.status.word] += 1
            states[one.state] += 1
            modes.update(f"{program.kinds[k].target} {program.kinds[k].mode}" for k in run.faults)
        again = own[: _MOST_REPEATED * _REPEATED : _REPEATED]
        failures += _other_bytes(program, again, dict(zip((run.seed for run in own), found, strict=True)), seed)
        done, compiled, repeated = done + len(own), compiled + 1, repeated + len(again)
        watch(done, len(failures))
    seconds = time.monotonic() - began
    return Faulted(done, dict(endings), dict(states), dict(modes), compiled, repeated, failures, seconds)


def _shown(watch: Callable[[int, int], None], before: int, failed: int, done: int) -> None:
    watch(before + done, failed)


def group(program: Program, runs: Sequence[Sampled]) -> Group:
    """The runs of a program, which is built once; the numbers of their faults are then written into its arrays."""
    run, plan, precision = prepared(build(program.scenario({}, 0)), windows=1)
    usual = [np.asarray(leaf) for leaf in jax.tree.leaves(eqx.filter(run, eqx.is_array))]
    at = [_places(usual, place) for place in range(len(program.kinds))]
    numbers = []
    for one in runs:
        leaves = list(usual)
        leaves[-1] = np.asarray(key_of_seed(one.seed))
        for place, entry in one.faults.items():
            for first in at[place]:
                _write(leaves, first, entry)
        numbers.append(leaves)
    return Group(run, plan, precision, list(range(len(runs))), numbers)


def _places(leaves: Sequence[np.ndarray], place: int) -> list[int]:
    """Numbers of the arrays with the onset of a fault, which stands in one or two places."""
    onset = _NEVER + place
    return [k for k, leaf in enumerate(leaves) if leaf.shape == (2,) and leaf.dtype.kind == "f" and leaf[0] == onset]


def _write(leaves: list[np.ndarray], first: int, entry: Mapping[str, Any]) -> None:
    """Write a fault into the arrays of its `Occurrence`: onset, duration, severity; its thruster stands after them."""
    alike = lambda place, value: np.full_like(leaves[place], value)
    leaves[first] = alike(first, entry["onset"])
    if "duration" in entry:
        leaves[first + 1] = alike(first + 1, entry["duration"])
    if "severity" in entry:
        leaves[first + 2] = alike(first + 2, entry["severity"])
    name, _, number = entry["target"].partition(" ")
    if name in _NUMBERED and first + 3 < len(leaves) and leaves[first + 3].sum() == 1:
        leaves[first + 3] = np.eye(leaves[first + 3].shape[0], dtype=leaves[first + 3].dtype)[int(number) - 1]


def _other_bytes(program: Program, runs: Sequence[Sampled], found: Mapping[int, Judged], seed: int) -> list[Failure]:
    """N6: runs whose bytes differ when they are built from their scenarios and run in the opposite order."""
    runs = runs[::-1]
    again = judged_runs([program.scenario(run.faults, run.seed) for run in runs])
    pairs = [(run, one) for run, one in zip(runs, again, strict=True) if one.digest != found[run.seed].digest]
    return [
        Failure(
            "N6", f"faults/{seed}/{run.seed}", f"digest {found[run.seed].digest}, and {one.digest} when it was repeated"
        )
        for run, one in pairs
    ]


def replay(identity: str) -> tuple[dict[str, Any], Judged]:
    """Scenario and run of an identity once more: `faults/SEED/NUMBER`."""
    _, seed, number = identity.split("/")
    several = programs()
    run = sampled(int(number) + 1, int(seed), several)[-1]
    scenario = several[run.program].scenario(run.faults, run.seed)
    return scenario, judged_runs([scenario])[0]
