"""Whether an experiment of `undertow identify-design` keeps what it promises: deviations predicted and obtained.

The vehicle is a BlueROV2 Heavy each of whose numbers is known to 30 %, in a room of 3 x 3 x 2 m for five minutes. Each
seed has a sample of the vehicles within these deviations, which carries out the script in simulation and is identified.
Obtained are the median of the deviations that the identification states, and the errors of its estimates.
`python benchmarks/identification_design.py --seeds 50`.
"""

import argparse
import time

import numpy as np

from undertow.core.runtime import in_precision
from undertow.scenario.build import build
from undertow.scenario.scenario_vehicle import vehicle_of
from undertow.scenario.uncertain_number import UncertainNumber
from undertow.studies.identification.design import STEP, design
from undertow.studies.identification.design_result import DesignRequest
from undertow.studies.identification.excitation_blocks import BLOCK
from undertow.studies.identification.fit import scores_of
from undertow.studies.identification.free_parameters import USUALLY_FREE, chosen, parameters_of
from undertow.studies.identification.model import Unknowns
from undertow.studies.identification.output_error import fit
from undertow.studies.identification.rehearsal import rehearse, with_vehicle
from undertow.studies.identification.segments import segments_of
from undertow.studies.identification.uncertainty import uncertainty_of

SHARE = 0.3  # deviation of each number
SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": "pid",
    "reference": {"kind": "setpoint", "position": [0, 0, 5, 0, 0, 0]},
    "navigation": {
        "kind": "white_noise",
        "position": [0.02, 0.02, 0.02, 0.01, 0.01, 0.01],
        "velocity": [0.02, 0.02, 0.02, 0.005, 0.005, 0.005],
    },
    "loop": {"dt": 0.05, "duration": 20, "record": 0.05},
}


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser()
    options.add_argument("--seeds", type=int, default=5)
    options.add_argument("--first", type=int, default=0)
    arguments = options.parse_args()
    with in_precision("float64"):
        run(arguments.seeds, arguments.first)


def run(seeds: int, first: int) -> None:
    """Design one experiment, and carry it out with one vehicle per seed."""
    built = build(SCENARIO)
    usual = chosen(parameters_of(vehicle_of(built)), USUALLY_FREE)
    priors = {p.name: UncertainNumber(p.prior, SHARE * abs(p.prior)) for p in usual if p.prior != 0}
    request = DesignRequest(room=(3.0, 3.0, 2.0), duration=300.0, free=tuple(priors), priors=priors)
    started = time.process_time()
    designed = design(built, request)
    print(f"designed in {time.process_time() - started:.0f} s of processor time, scale {designed.scale:.2f}")
    parameters = [expected.parameter for expected in designed.expected]
    unknowns = Unknowns(tuple(parameters), 1)
    least, count = unknowns.least(), len(parameters)
    scenario = {key: value for key, value in designed.scenario.items() if key != "supervisor"}
    shares, errors, use = np.zeros((seeds, count)), np.zeros((seeds, count)), np.zeros(seeds)
    started = time.process_time()
    for number in range(seeds):
        generator = np.random.default_rng(first + number)
        truth = np.zeros(len(least))
        truth[:count] = np.maximum(generator.standard_normal(count), least[:count])
        placed = with_vehicle(build(scenario | {"seed": first + number}), designed.model, truth)
        rehearsal = rehearse(placed, scenario["reference"]["position"], STEP)
        segments = segments_of([rehearsal.dive.dive], BLOCK)
        estimate = fit(designed.model, segments, STEP, np.zeros(len(least)), least)
        uncertainty = uncertainty_of(estimate.information, scores_of(designed.model, STEP, estimate), STEP)
        shares[number] = [interval.share for interval in uncertainty.intervals(parameters, estimate.z)]
        errors[number] = (estimate.z - truth)[:count]
        use[number] = rehearsal.use_of(designed.limits).max()
        print(
            f"seed {first + number}: {estimate.iterations} iterations, converged {estimate.converged}, "
            f"limits used {100 * use[number]:.0f} %, abort {rehearsal.abort}",
            flush=True,
        )
    print(f"{'deviation left, % of 30 %':28}{'predicted':>10}{'stated':>10}{'errors':>10}{'stated/predicted':>18}")
    for i, expected in enumerate(designed.expected):
        stated, error = np.median(shares[:, i]), np.sqrt((errors[:, i] ** 2).mean())
        row = (100 * expected.share, 100 * stated, 100 * error, stated / expected.share)
        print(f"{expected.parameter.name:28}{row[0]:10.2f}{row[1]:10.2f}{row[2]:10.2f}{row[3]:18.2f}")
    predicted = np.array([expected.share for expected in designed.expected])
    within = np.abs(np.median(shares, axis=0) / predicted - 1) <= 0.2
    print(f"{within.sum()} of {count} within 20 %; {(predicted < 0.5).sum()} of {count} halved as predicted")
    print(f"limits used: at most {100 * use.max():.0f} %; {(use > 1).sum()} of {seeds} scripts ended early")
    print(f"{(time.process_time() - started) / seeds:.1f} s of processor time a seed")


if __name__ == "__main__":
    main()
