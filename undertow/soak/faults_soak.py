"""Runs with random faults under supervision: whatever fails, an input that is not allowed never reaches the plant."""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.soak.judged_runs import Judged, judged_runs
from undertow.soak.verdict import Failure

# Of so many runs one is repeated, in other company, and no more of a block: each may need a program of its own.
_REPEATED, _MOST_REPEATED = 20, 25
_BLOCK = 10_000  # scenarios that share programs; their numbers are in memory at once
_PAIRS = 0.2  # share of runs with two faults
_KINDS_OF_PAIRS = 10  # different pairs of each loop: each has a program of its own
_DURATION = 20.0  # s

# Loops that are given faults; under supervision, at 50 Hz.
LOOPS: dict[str, dict[str, Any]] = {
    "BlueROV2 Heavy, robust law": {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
        "model": {"rate_term": True},
        "controller": {"kind": "rcaf", "preset": "robust"},
        "navigation": {"kind": "white_noise", "position": 0.005, "velocity": 0.01},
    },
    "ODIN, PID": {
        "plant": {"vehicle": "odin", "thruster": {"kind": "paper_table3", "fidelity": "static", "supply": 24}},
        "controller": {"kind": "pid"},
        "navigation": {"kind": "white_noise", "position": 0.005, "velocity": 0.01},
    },
}
_COMMON: dict[str, Any] = {
    "supervisor": True,
    "reference": {"kind": "setpoint", "position": [1.0, 0.5, 0.5, 0.0, 0.0, 0.3], "settling": 8},
    "disturbance": {"kind": "current", "velocity": [0.2, 0.1, 0.0]},
    "loop": {"kind": "sampled", "dt": 0.02, "duration": _DURATION, "record": 1.0},
}

Scenario = Mapping[str, Any]


class Faulted(NamedTuple):
    """Result of runs with faults.

    Attributes:
        number: runs.
        endings: runs by how they ended.
        modes: faults by target and mode, such as `thruster off`.
        programs: how many were compiled.
        repeated: runs that were repeated.
        failures: never-events.
        seconds: elapsed time.
    """

    number: int
    endings: dict[str, int]
    modes: dict[str, int]
    repeated: int
    failures: list[Failure]
    seconds: float


def faulted_scenarios(number: int, seed: int) -> Iterator[dict[str, Any]]:
    """So many scenarios with random faults, half of them of each loop.

    Args:
        number: how many.
        seed: of all of them.

    Raises:
        BadInput: this version has no faults.
    """
    check_available()
    from undertow.faults.sampling import random_faults  # pyright: ignore[reportMissingImports]

    chance = np.random.default_rng([seed, 20])
    loops = [(name, LOOPS[name] | _COMMON) for name in LOOPS]
    built = [build({**one, "supervisor": None}).closed_loop for _, one in loops]
    pools: list[dict[str, dict[str, Any]]] = [{} for _ in loops]  # the latest fault of each kind
    pairs: list[list[tuple[str, str]]] = [[] for _ in loops]
    for i in range(number):
        place = i % len(loops)
        faults = random_faults(chance, built[place].plant, built[place].navigation, _DURATION)
        pool = pools[place]
        pool[_kind(faults[0])] = faults[0]
        if chance.uniform() < _PAIRS and len(pool) > _KINDS_OF_PAIRS:
            if len(pairs[place]) < _KINDS_OF_PAIRS:
                first, second = chance.choice(sorted(pool), 2, replace=False)
                pairs[place].append((str(first), str(second)))
            pair = pairs[place][int(chance.integers(len(pairs[place])))]
            faults = [pool[kind] for kind in pair]
        yield loops[place][1] | {"faults": faults, "seed": i}


def run_faulted(
    scenarios: Sequence[Scenario] | Iterator[Scenario],
    seed: int,
    until: float = float("inf"),
    watch: Callable[[int, int], None] = lambda done, failed: None,
) -> Faulted:
    """Run scenarios, judge each of them for never-events, and repeat some of them.

    Args:
        scenarios: with faults or without.
        seed: from which they were made, for the identities of failures.
        until: time of `time.monotonic` after which no further block of runs begins.
        watch: called with the numbers of runs and of failures so far.
    """
    began, several = time.monotonic(), iter(scenarios)
    endings: Counter[str] = Counter()
    modes: Counter[str] = Counter()
    failures: list[Failure] = []
    number = repeated = 0
    while time.monotonic() < until and (block := _next(several, _BLOCK)):
        found = judged_runs(block, watch=partial(_shown, watch, number, len(failures)))
        identities = [f"faults/{seed}/{number + i}" for i in range(len(block))]
        for identity, one, scenario in zip(identities, found, block, strict=True):
            failures += [Failure(event, identity, says) for event, says in one.events()]
            endings[one.status.word] += 1
            modes.update(_kind(fault) for fault in scenario.get("faults", ()))
        failures += _other_bytes(block, found, identities)
        number, repeated = number + len(block), repeated + len(_repeated(block))
        watch(number, len(failures))
    return Faulted(number, dict(endings), dict(modes), repeated, failures, time.monotonic() - began)


def _shown(watch: Callable[[int, int], None], before: int, failed: int, done: int) -> None:
    watch(before + done, failed)


def _other_bytes(block: Sequence[Scenario], found: Sequence[Judged], identities: Sequence[str]) -> list[Failure]:
    """N6: runs whose bytes differ when they are run again, in the opposite order and with fewer others."""
    places = _repeated(block)[::-1]
    again = judged_runs([block[place] for place in places])
    pairs = [(place, one) for place, one in zip(places, again, strict=True) if one.digest != found[place].digest]
    return [
        Failure("N6", identities[place], f"digest {found[place].digest}, and {one.digest} when it was repeated")
        for place, one in pairs
    ]


def _repeated(block: Sequence[Scenario]) -> range:
    """Places of the runs that are repeated."""
    return range(0, len(block), _REPEATED)[:_MOST_REPEATED]


def replay(identity: str) -> tuple[dict[str, Any], Judged]:
    """Scenario and run of an identity once more: `faults/SEED/NUMBER`."""
    _, seed, number = identity.split("/")
    scenario = list(faulted_scenarios(int(number) + 1, int(seed)))[-1]
    return scenario, judged_runs([scenario])[0]


def available() -> bool:
    """Whether this version has faults that can be injected."""
    return find_spec("undertow.faults") is not None


def check_available() -> None:
    """Check that there are faults to sample.

    Raises:
        BadInput: this version has none.
    """
    if not available():
        raise BadInput("--faults", "be 0", hint="This version has no faults that can be injected")


def _kind(fault: Mapping[str, Any]) -> str:
    """Target and mode of a fault: thrusters are one target, whatever their number."""
    return f"{str(fault['target']).split(' ')[0]} {fault['mode']}"


def _next(several: Iterator[Scenario], most: int) -> list[Scenario]:
    return [one for one, _ in zip(several, range(most), strict=False)]
