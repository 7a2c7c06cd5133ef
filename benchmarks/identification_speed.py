"""How long `undertow identify` takes for a dive of ten minutes with forty unknown numbers: weak form, and estimate.

`python benchmarks/identification_speed.py`; both are also given as multiples of the time of `import jax`.
"""

import argparse
import subprocess
import sys
import time

import numpy as np

from undertow.core.runtime import in_precision
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.studies.identification.dive import dive_of
from undertow.studies.identification.estimates import Estimates
from undertow.studies.identification.free_parameters import chosen, parameters_of, resolved_by
from undertow.studies.identification.identified_vehicle import prior_vehicle
from undertow.studies.identification.model import NUISANCES, model_of
from undertow.studies.identification.simulated_dive import telegraph_dive
from undertow.studies.identification.weak_form import first_estimate

FREE = (
    "added_mass", "linear_damping", "quadratic_damping", "net_buoyancy", "r_b",
    "reverse_gain", "lag", "mass", "inertia",
)  # fmt: skip
STEP, SEGMENT = 0.05, 10.0  # s


def main() -> None:
    """Print the times."""
    options = argparse.ArgumentParser()
    options.add_argument("--duration", type=float, default=600.0, help="s")
    with in_precision("float64"):
        run(options.parse_args().duration)


def run(duration: float) -> None:
    """Simulate a dive, and identify its vehicle."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200())
    gains = tuple(f"thruster_gain.T{j + 1}" for j in range(plant.inputs()))
    parameters = resolved_by(STEP, plant, chosen(parameters_of(plant), (*FREE, *gains)))
    model = model_of(prior_vehicle(plant), parameters)
    away = 0.3 * np.random.default_rng(1).standard_normal(len(parameters))
    truth = {parameter.name: float(parameter.value(z)) for parameter, z in zip(parameters, away, strict=True)}
    log = telegraph_dive(plant, truth, 0, duration)
    dive = dive_of(log, log["input"], STEP)
    unit = _import_time()
    print(f"{duration:g} s, {len(parameters)} parameters and {len(NUISANCES)} nuisances; import jax {unit:.2f} s")
    for again in ("", " again, compiled"):
        started = time.perf_counter()
        first_estimate(model.prior, parameters, [dive])
        _print(f"weak form{again}", time.perf_counter() - started, unit)
    started = time.perf_counter()
    estimates = Estimates(model, parameters, SEGMENT, 1, lambda stage: None)
    estimate = estimates.of("the dive", [dive], estimates.nearest_begin([dive]))
    _print("weak form and estimate", time.perf_counter() - started, unit)
    print(f"{estimate.iterations} iterations, converged {estimate.converged}")


def _import_time() -> float:
    started = time.perf_counter()
    subprocess.run([sys.executable, "-c", "import jax"], check=True)
    return time.perf_counter() - started


def _print(what: str, seconds: float, unit: float) -> None:
    print(f"{what}: {seconds:.1f} s, {seconds / unit:.0f} times import jax", flush=True)


if __name__ == "__main__":
    main()
