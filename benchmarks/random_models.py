"""A law with random wrong models: vehicles that differ from the nominal one in every respect at once.

Each combination takes a vehicle with its nominal model, one of six references, a current and waves, and measures
perfectly or by sensors and the filter `observer`. The simulated vehicle then differs from the model: drag by a factor
of 0.1 to 10, mass, weight and buoyancy of 0.7 to 1.5, inertia of 0.5 to 2, lag of the thrusters of 1/3 to 3, distance
of the centres of gravity and buoyancy of 0 to 5 times. The first combinations vary one of these alone, each to
both ends. 80 s; lost and bad as in foreign_models.py.

    python benchmarks/random_models.py [--runs 500] [--rate 50] [--law robust] [--seed 0] [--list]

For every lost run the scenario is checked as `undertow check` does, on the vehicle that is simulated: `warned` counts
those with advice on its loop, reference or load. `upside down` counts runs that turn more than 90 degrees from
their reference, and have status completed. About ten minutes on two cores.
"""

import argparse
import dataclasses
import itertools
import sys
from typing import Any, NamedTuple

import equinox as eqx
import numpy as np
from foreign_models import DURATION, RECORD, Errors, run_all

from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built, build
from undertow.scenario.checks.flow_stability import flow_advice
from undertow.scenario.part_cache import PartCache
from undertow.scenario.plausibility import plausibility
from undertow.scenario.reading import from_data
from undertow.scenario.step_size import step_advice
from undertow.studies.arena.vehicles import VEHICLES

# Factors on the nominal vehicle: lowest, highest, and whether they are spread evenly in their logarithm.
FACTORS = {
    "drag": (0.1, 10.0, True),
    "mass": (0.7, 1.5, True),
    "inertia": (0.5, 2.0, True),
    "lag": (1 / 3, 3.0, True),
    "righting": (0.0, 5.0, False),
}
_UPSIDE_DOWN = np.pi / 2  # rad
_SUBSTEPS = 4  # that fast decays by drag are integrated


class Combination(NamedTuple):
    """One run."""

    vehicle: str
    reference: str
    readings: bool
    factors: dict[str, float]  # by name; those left out are 1
    current: float  # direction, rad
    height: float  # significant, of the waves, as a share of that of the arena

    def group(self) -> tuple[str, str, bool]:
        """What runs of one program share."""
        return self.vehicle, self.reference, self.readings


class Run(NamedTuple):
    """A combination that was run."""

    combination: Combination
    errors: Errors  # of one run
    advice: list[str]  # where it is lost: what `check` says of it beforehand


def references(reach: float, speed: float) -> dict[str, dict[str, Any]]:
    """Six motions of a size, m, and a largest speed, m/s."""
    rate = speed / reach
    return {
        "station": {"kind": "setpoint", "position": [0.0] * 6},
        "step": {"kind": "setpoint", "position": [reach, reach / 2, reach / 3, 0, 0, 0.5], "settling": 5},
        "lissajous": {
            "kind": "lissajous",
            "amplitude": [reach, 0.5 * reach, 0.3 * reach, 0.5],
            "frequency": [0.8 * rate, rate, 0.6 * rate, 0.4 * rate],
        },
        "circle": {"kind": "circle", "radius": reach, "period": 2 * np.pi / rate, "heading": "along"},
        "lawn mower": {"kind": "lawn_mower", "length": 5 * reach, "spacing": reach, "speed": speed, "heading": "along"},
        "helix": {"kind": "helix", "radius": reach, "period": 2 * np.pi / rate, "sink_rate": 0.03},
    }


def combinations(runs: int, seed: int) -> list[Combination]:
    """Each factor alone at both ends, then random ones."""
    chance = np.random.default_rng(seed)
    alone = [{name: end} for name, (low, high, _) in FACTORS.items() for end in (low, high)]
    found = []
    for number in range(runs):
        spread = lambda low, high, even: (
            np.exp(chance.uniform(*np.log([low, high]))) if even else chance.uniform(low, high)
        )
        together = {name: float(spread(*bounds)) for name, bounds in FACTORS.items()}
        vehicle = str(chance.choice(list(VEHICLES)))
        reference = str(chance.choice(list(references(1.0, 1.0))))
        readings, direction, height = bool(chance.integers(2)), chance.uniform(0, 2 * np.pi), chance.uniform(0.05, 1)
        factors = alone[number] if number < len(alone) else together
        found.append(Combination(vehicle, reference, readings, factors, float(direction), float(height)))
    return found


def scenario_of(one: Combination, rate: int, law: str) -> dict[str, Any]:
    """The scenario with the nominal vehicle."""
    v = VEHICLES[one.vehicle]
    speed = float(np.hypot(*v.current[:2]))
    return {
        "plant": {"vehicle": one.vehicle, "thruster": v.thruster, "ledger": False},
        "model": {"rate_term": True},
        "controller": law,
        "reference": references(v.reach, v.speed)[one.reference],
        "disturbance": [
            {"kind": "current", "velocity": [speed * np.cos(one.current), speed * np.sin(one.current), 0.0]},
            {"kind": "waves", "height": one.height * v.waves, "period": 5, "depth": 3},
        ],
        "navigation": "observer" if one.readings else "perfect",
        "loop": {"dt": 1 / rate, "substeps": _SUBSTEPS, "duration": DURATION, "record": RECORD},
        "success": {"position_rms": v.position, "orientation_rms": v.orientation},
    }


def changed(plant: HybridVehicle, factors: dict[str, float]) -> HybridVehicle:
    """The plant with factors on its numbers, of which the law knows nothing."""
    vehicle, thruster = plant.vehicle, plant.thruster
    factor = lambda name: factors.get(name, 1.0)
    vehicle = dataclasses.replace(
        vehicle,
        mass=vehicle.mass * factor("mass"),
        weight=vehicle.weight * factor("mass"),
        buoyancy=vehicle.buoyancy * factor("mass"),
        inertia=vehicle.inertia * factor("inertia"),
        linear_damping=vehicle.linear_damping * factor("drag"),
        quadratic_damping=vehicle.quadratic_damping * factor("drag"),
        r_b=vehicle.r_g + factor("righting") * (vehicle.r_b - vehicle.r_g),
    )
    slow = (lambda t: t.motor.rotor_inertia) if hasattr(thruster, "motor") else (lambda t: t.time_constant)
    thruster = eqx.tree_at(slow, thruster, slow(thruster) * factor("lag"))
    return HybridVehicle(vehicle, thruster, ledger=False)


def built_of(one: Combination, rate: int, law: str, cache: PartCache) -> Built:
    """The scenario with the law of the nominal vehicle and the changed one."""
    built = build(from_data(scenario_of(one, rate, law)), cache)
    loop = built.closed_loop
    assert isinstance(loop.plant, HybridVehicle)
    return built._replace(closed_loop=dataclasses.replace(loop, plant=changed(loop.plant, one.factors)))


def warnings(built: Built) -> list[str]:
    """Advice on loop, reference and load that `check`, `simulate` and `analyze` give before the run."""
    plant = built.closed_loop.plant
    assert isinstance(plant, HybridVehicle)
    of_steps = step_advice(plant, built.scenario.loop)
    found = (*of_steps, *plausibility(built.closed_loop, DURATION, None), *flow_advice(built))
    return [one.sentence for one in found if "Angles" not in one.hint]


def main() -> None:
    """Run all combinations and print a table by vehicle."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--rate", type=int, default=50)
    parser.add_argument("--law", default="robust")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    order = sorted(combinations(options.runs, options.seed), key=Combination.group)
    cache, done = PartCache(), []
    for _, group in itertools.groupby(order, key=Combination.group):
        done += runs_of(list(group), options.rate, options.law, cache)
        print(f"{len(done)} of {options.runs} runs", file=sys.stderr)
    _report(done, options.list)


def runs_of(some: list[Combination], rate: int, law: str, cache: PartCache) -> list[Run]:
    """Combinations of one group, run at once."""
    each = [built_of(one, rate, law, cache) for one in some]
    errors = run_all([one.closed_loop for one in each], 1 / rate, range(len(each)), _SUBSTEPS)
    alone = [Errors(*(column[i : i + 1] for column in errors)) for i in range(len(each))]
    of_lost = [warnings(built) if found.lost()[0] else [] for built, found in zip(each, alone, strict=True)]
    return [Run(*one) for one in zip(some, alone, of_lost, strict=True)]


def _report(done: list[Run], listed: bool) -> None:
    print(
        f"{'vehicle':<16}{'runs':>5}{'lost':>6}{'warned':>8}{'bad':>5}{'median mm':>11}{'90 %':>9}{'upside down':>13}"
    )
    for vehicle in (*VEHICLES, "all"):
        some = [one for one in done if vehicle in (one.combination.vehicle, "all")]
        errors = Errors(*(np.concatenate(column) for column in zip(*(one.errors for one in some), strict=True)))
        position = np.sort(1e3 * errors.position)
        print(
            f"{vehicle:<16}{len(some):>5}{errors.lost().sum():>6}{sum(bool(one.advice) for one in some):>8}"
            f"{errors.bad().sum():>5}{np.median(position):>11.1f}{position[int(0.9 * len(position))]:>9.1f}"
            f"{((errors.farthest > _UPSIDE_DOWN) & ~errors.ended).sum():>13}"
        )
    for combination, found, advice in done if listed else ():
        if found.bad()[0]:
            factors = ", ".join(f"{name} {value:.3g}" for name, value in combination.factors.items())
            measured = "readings" if combination.readings else "perfect"
            where = f"{combination.vehicle}, {combination.reference}, {measured}, {factors}"
            size = f"{found.position[0]:.3g} m, {found.attitude[0]:.2g} rad rms, {found.farthest[0]:.2g} rad"
            print(f"{where}: {size}{', ended' if found.ended[0] else ''}", *advice, sep="\n    ")


if __name__ == "__main__":
    main()
