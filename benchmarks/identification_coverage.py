"""How often the 95 % intervals of `undertow identify` contain the truth, parameter by parameter, on simulated dives.

Each seed has a BlueROV2 Heavy whose numbers differ at random from the vehicle file, as much as the deviations
beforehand say (damping by 30 %, the centre of buoyancy by 9 mm, ...), a current, noise of all sensors, and uneven
times of samples. The last columns are the rms of the errors, each over its stated deviation: 1 if that is right; and
over the deviation beforehand.

    python benchmarks/identification_coverage.py --seeds 200
    python benchmarks/identification_coverage.py --disturbed --method prediction_error

With `--disturbed`, forces of 4 N and moments of 0.4 N m that vary within 2 s push the vehicle, and no log has them.
"""

import argparse
import time

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.errors import BadInput
from undertow.core.runtime import in_precision
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.studies.identification.dive import dive_of
from undertow.studies.identification.estimates import METHODS, Estimates
from undertow.studies.identification.fit import scores_of
from undertow.studies.identification.free_parameters import chosen, parameters_of, resolved_by
from undertow.studies.identification.identified_vehicle import prior_vehicle
from undertow.studies.identification.model import NUISANCES, Unknowns, model_of
from undertow.studies.identification.simulated_dive import random_wrenches, telegraph_log
from undertow.studies.identification.uncertainty import uncertainty_of

SEGMENT = 10.0  # s
PRIOR = 0.3  # deviations beforehand, as a share of the usual ones; three times that is another vehicle
DISTURBANCE = np.repeat([4.0, 0.4], 3)  # N and N m, standard deviations
CORRELATION_TIME = 2.0  # s, of the disturbance


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser()
    options.add_argument("--seeds", type=int, default=20)
    options.add_argument("--first", type=int, default=0)
    options.add_argument("--duration", type=float, default=60.0, help="s")
    options.add_argument("--disturbed", action="store_true", help="unknown forces push the vehicle")
    options.add_argument("--method", choices=METHODS, default=METHODS[0])
    options.add_argument("--step", type=float, default=0.05, help="s")
    arguments = options.parse_args()
    with in_precision("float64"):
        run(arguments)


def run(arguments: argparse.Namespace) -> None:
    """Identify one vehicle per seed, and count."""
    seeds, first, duration, step = arguments.seeds, arguments.first, arguments.duration, arguments.step
    plant = hybrid_vehicle(bluerov2_heavy(), t200())
    prior = prior_vehicle(plant)
    usual = resolved_by(step, plant, chosen(parameters_of(plant)))
    parameters = [p._replace(deviation=PRIOR * p.deviation) for p in usual]
    model = model_of(prior, parameters)
    unknowns = Unknowns(tuple(parameters), 1)
    make = jax.jit(lambda z: model.candidate(z).vehicle)
    inside = np.zeros((seeds, len(parameters)), dtype=bool)
    shares = np.zeros((seeds, len(parameters)))
    errors = np.zeros((seeds, len(parameters)))
    done = np.zeros(seeds, dtype=bool)
    started = time.process_time()
    for number in range(seeds):
        generator = np.random.default_rng(first + number)
        truth = generator.standard_normal(len(parameters))
        truth = np.maximum(truth, unknowns.least()[: len(parameters)])
        vehicle = make(jnp.asarray(np.concatenate([truth, np.zeros(len(NUISANCES))])))
        current = (*generator.uniform(-0.2, 0.2, 2), 0.0)
        pushes = random_wrenches(generator, duration, DISTURBANCE, CORRELATION_TIME) if arguments.disturbed else None
        log = telegraph_log(plant, vehicle, generator, duration, current=current, disturbance=pushes)
        dive = dive_of(log, log["input"], step)
        estimates = Estimates(model, parameters, SEGMENT, arguments.method, 1, lambda stage: None)
        try:
            estimate = estimates.of("dive", [dive], estimates.nearest_begin([dive]))
        except BadInput as refused:
            print(f"seed {first + number}: {refused}")
            continue
        done[number] = True
        uncertainty = uncertainty_of(estimate.information, scores_of(model, step, estimate), step)
        intervals = uncertainty.intervals(parameters, estimate.z)
        values = [parameter.value(z) for parameter, z in zip(parameters, truth, strict=True)]
        inside[number] = [i.low <= value <= i.high for i, value in zip(intervals, values, strict=True)]
        shares[number] = [interval.share for interval in intervals]
        errors[number] = estimate.z[: len(parameters)] - truth
        missed = [p.name for p, good in zip(parameters, inside[number], strict=True) if not good]
        print(
            f"seed {first + number}: {estimate.iterations} iterations, converged {estimate.converged}, missed {missed}"
        )
    inside, shares, errors = inside[done], shares[done], errors[done]
    rms = lambda values: float(np.sqrt((values**2).mean()))
    print(f"{'parameter':28}covered, %   deviation left   error, rms   of the deviation beforehand")
    for i, parameter in enumerate(parameters):
        covered, share = 100 * inside[:, i].mean(), np.median(shares[:, i])
        relative = rms(errors[:, i] / shares[:, i])
        print(f"{parameter.name:28}{covered:8.1f}   {share:12.3f}   {relative:13.2f}   {rms(errors[:, i]):13.3f}")
    seconds = (time.process_time() - started) / seeds
    print(f"all {done.sum()}: {100 * inside.mean():.1f} %, {seconds:.1f} s of processor time a seed")


if __name__ == "__main__":
    main()
