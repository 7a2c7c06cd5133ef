"""Wrong measurements in sequence: thrust that they cause, without and with a supervisor.

    python benchmarks/wrong_sequences.py [named] [random] [--runs N] [--first SEED] [--duration S]

A BlueROV2 Heavy holds its place in a current of 0.2 m/s, with preset robust at 50 Hz and exact readings, stepped as a
link steps it. From 5 s on something that the controller is given is wrong; the vehicle moves on as it does.

named: the worst sequences that an attack had found.
random: sequences of the same kinds, one or two at a time, each from a seed of its own.

Printed of the time after the onset: volts of all thrusters, summed over time; time with any thruster at 95 % of its
limit or more; longest way from the start; and how the supervisor ended.
"""

import argparse
import tempfile
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np

import undertow as ut
from soak.links.driven_vehicle import DrivenVehicle
from soak.links.scenario import SUPPLY
from undertow.scenario.reading import dump

DT, ONSET = 0.02, 5.0  # s
ALWAYS = 1e9  # s
SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": SUPPLY}},
    "controller": "robust",
    "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
    "disturbance": {"kind": "current", "velocity": [0.2, 0, 0]},
    "loop": {"dt": DT, "record": DT, "duration": 20},
}
QUANTITIES = ("position", "attitude", "velocity", "rate", "applied")
FORMS = ("constant", "alternating", "ramp", "random", "sine", "frozen")
# Largest size, by quantity: m, rad, m/s, rad/s, V.
LARGEST = {"position": 100.0, "attitude": np.pi, "velocity": 20.0, "rate": 20.0, "applied": SUPPLY}
LEAST = 0.05  # share of the usual limits of jumps, from which on a sequence is sampled
UNIT = {"position": 1.0, "attitude": 0.5, "velocity": 1.0, "rate": 1.0, "applied": SUPPLY}


class Wrong(NamedTuple):
    """Something that is wrong from the onset on.

    Attributes:
        quantity: of `QUANTITIES`; an attitude is turned, an applied input replaced, the others get an offset.
        form: of `FORMS`; `frozen` repeats the reading of the onset.
        size: of the offset, m, rad, m/s, rad/s or V; that of a ramp is added at each step.
        direction: of the offset in its axes, of length 1; of an applied input one number per thruster.
        length: s.
        period: of a sine, s.
        seed: of random offsets.
    """

    quantity: str
    form: str
    size: float
    direction: tuple[float, ...]
    length: float = ALWAYS
    period: float = 1.0
    seed: int = 0

    def offset(self, step: int) -> np.ndarray:
        """Offset at a step after the onset; that of a ramp stays at its end."""
        count = min(step + 1, round(self.length / DT)) if self.form == "ramp" else step + 1
        ended = self.form != "ramp" and step * DT >= self.length
        chance = np.random.default_rng([self.seed, step]) if self.form == "random" else None
        share = {
            "constant": 1.0,
            "alternating": (-1.0) ** step,
            "ramp": float(count),
            "random": 0.0 if chance is None else chance.uniform(-1, 1),
            "sine": np.sin(2 * np.pi * step * DT / self.period),
            "frozen": 0.0,
        }[self.form]
        return 0.0 * np.array(self.direction) if ended else share * self.size * np.array(self.direction)

    def __str__(self) -> str:
        length = "" if self.length >= ALWAYS else f" for {self.length:.2g} s"
        period = f", period {self.period:.2g} s" if self.form == "sine" else ""
        along = ", ".join(f"{one:.2g}" for one in self.direction)
        return f"{self.quantity} {self.form} {self.size:.3g}{length}{period} ({along})"


class Caused(NamedTuple):
    """What a run showed after the onset."""

    volt_seconds: float
    full: float  # s
    way: float  # m
    state: str
    reason: str

    def __str__(self) -> str:
        return f"{self.volt_seconds:7.0f} V s {self.full:6.1f} s full {self.way:6.1f} m  {self.state} {self.reason}"


NORTH, YAW = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
ALL = (1.0,) * 8
NAMED = {
    "nothing wrong": (),
    "position +-0.45 m, alternating": (Wrong("position", "alternating", 0.45, NORTH),),
    "position +-0.3 m, twice a second": (Wrong("position", "sine", 0.3, NORTH, period=0.5),),
    "position +0.9 m per step, 2 s": (Wrong("position", "ramp", 0.9, NORTH, length=2.0),),
    "position reset by 100 m": (Wrong("position", "constant", 100.0, NORTH),),
    "heading +0.45 rad per step": (Wrong("attitude", "ramp", 0.45, YAW),),
    "applied reported as +16 V": (Wrong("applied", "constant", SUPPLY, ALL),),
    "velocity +0.95 m/s": (Wrong("velocity", "constant", 0.95, NORTH),),
}


def sampled(seed: int) -> tuple[Wrong, ...]:
    """One or two wrong quantities of a random sequence."""
    generator = np.random.default_rng(seed)
    return tuple(_one(generator) for _ in range(1 + (generator.random() < 0.3)))


def _one(generator: np.random.Generator) -> Wrong:
    quantity, form = str(generator.choice(QUANTITIES)), str(generator.choice(FORMS))
    of_actuators = quantity == "applied"
    if of_actuators:
        direction = np.where(generator.random(8) < 0.5, generator.uniform(-1, 1, 8), generator.choice([-1.0, 1.0]))
    else:
        direction = generator.normal(size=3)
        direction = (
            np.eye(3)[generator.integers(3)] if generator.random() < 0.5 else direction / np.linalg.norm(direction)
        )
    size = np.exp(generator.uniform(np.log(LEAST * UNIT[quantity]), np.log(LARGEST[quantity])))
    if form == "ramp":  # by the limit of a jump in each step at most
        size = np.exp(generator.uniform(np.log(1e-3), 0.0)) * UNIT[quantity]
    return Wrong(
        quantity=quantity,
        form=form,
        size=float(size),
        direction=tuple(direction.tolist()),
        length=float(np.exp(generator.uniform(np.log(DT), np.log(20.0)))) if generator.random() < 0.5 else ALWAYS,
        period=float(np.exp(generator.uniform(np.log(2 * DT), np.log(20.0)))),
        seed=int(generator.integers(2**31)),
    )


class Attacked:
    """A vehicle with its controller, of which readings can be wrong."""

    def __init__(self, **changes: object):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "vehicle.yaml"
            path.write_text(dump(SCENARIO | changes))
            self._vehicle, self._law = DrivenVehicle(path), ut.Autopilot(path, attitude="quaternion")

    def run(self, wrong: tuple[Wrong, ...], duration: float) -> Caused:
        """One run of so many seconds after the onset."""
        vehicle, law = self._vehicle, self._law
        vehicle.restart()
        onset, frozen = round(ONSET / DT), {}
        for step in range(onset + round(duration / DT)):
            motion_now = vehicle.motion
            if step == onset:
                vehicle.count_anew()
            given = {
                "position": motion_now.position,
                "attitude": motion_now.attitude,
                "velocity": motion_now.velocity[:3],
                "rate": motion_now.velocity[3:],
                "applied": vehicle.vehicle.output.applied,
            }
            for one in wrong if step >= onset else ():
                given[one.quantity] = _wrong(one, step - onset, given[one.quantity], frozen)
            motion = given["position"], np.concatenate([given["velocity"], given["rate"]]), given["attitude"]
            volts = law.step(*motion, applied=given["applied"]) if step else law.start(*motion)
            vehicle.hold(volts, DT)
            if vehicle.failed:
                break
        ended = law.state if law.supervised else ("", "")
        return Caused(vehicle.volt_seconds, vehicle.full, vehicle.furthest, *ended)


def _wrong(one: Wrong, step: int, true: np.ndarray, frozen: dict[str, np.ndarray]) -> np.ndarray:
    """What is given in place of a reading."""
    ended = step * DT >= one.length and one.form != "ramp"
    if one.form == "frozen":
        return true if ended else frozen.setdefault(one.quantity, true)
    offset = one.offset(step)
    if one.quantity == "applied":
        return true if ended else np.clip(offset, -SUPPLY, SUPPLY)
    if one.quantity == "attitude":
        return _turned(offset, true)
    return true + offset


def _turned(turn: np.ndarray, attitude: np.ndarray) -> np.ndarray:
    """A quaternion, body -> world, turned about a vector in world axes, rad."""
    angle = np.linalg.norm(turn)
    if angle == 0:
        return attitude
    w, x, y, z = np.cos(angle / 2), *(np.sin(angle / 2) * turn / angle)
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]) @ attitude


def named(duration: float) -> None:
    """The known sequences, without and with a supervisor."""
    without, supervised = Attacked(), Attacked(supervisor=True)
    for name, wrong in NAMED.items():
        print(f"{name:34} without {without.run(wrong, duration)}", flush=True)
        print(f"{'':34} with    {supervised.run(wrong, duration)}", flush=True)


def random(duration: float, runs: int, first: int) -> None:
    """Random sequences with a supervisor: how bad the worst are."""
    without, supervised = Attacked(), Attacked(supervisor=True)
    seeds = range(first, first + runs)
    bare = [without.run(sampled(seed), duration) for seed in seeds]
    found = [supervised.run(sampled(seed), duration) for seed in seeds]
    for name, results in (("without", bare), ("with", found)):
        full, volts, way = (np.array([getattr(one, key) for one in results]) for key in ("full", "volt_seconds", "way"))
        parts = [
            f"{what} median {np.median(of):.3g}, 95 % {np.quantile(of, 0.95):.3g}, largest {of.max():.3g}"
            for what, of in (("s full", full), ("V s", volts), ("m", way))
        ]
        print(f"{name:8} {runs} runs of {duration:g} s: {'; '.join(parts)}; more than 0.5 s full: {(full > 0.5).sum()}")
    print(f"supervisor at the end: {dict(Counter(one.state for one in found))}")
    for place in sorted(range(runs), key=lambda k: -found[k].full)[:25]:
        print(f"{seeds[place]:6} {found[place]}  {'; '.join(map(str, sampled(seeds[place])))}")


def main() -> None:
    """Print the parts that are asked for; all without arguments."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=["named", "random", []], default=["named", "random"])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--duration", type=float, default=20.0)
    options = parser.parse_args()
    if "named" in options.parts:
        named(options.duration)
    if "random" in options.parts:
        random(options.duration, options.runs, options.first)


if __name__ == "__main__":
    main()
