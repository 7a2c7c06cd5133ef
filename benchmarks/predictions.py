"""Predicted against simulated metrics of 40 loops: vehicles, laws, rates and seas.

Each vehicle keeps station in the current of the arena and in waves, with perfect measurements. The prediction is that
of `undertow simulate`: the linearised loop along the loads of the same seed.

    python benchmarks/predictions.py [--laws robust,pid,lqi,adrc,disturbance_observer]

A line per loop: rms of position and attitude, predicted and simulated over the second half of 60 s, and what `simulate`
prints about them. Ten minutes on two cores.
"""

import argparse
import itertools

import numpy as np

from undertow.cli.run_presentation import comparison, predict
from undertow.scenario.reading import from_data
from undertow.scenario.results.run_scenario import run_scenario
from undertow.studies.arena.vehicles import VEHICLES

# Rate of the loop, Hz, and significant height of the waves as a share of that of the arena.
CONDITIONS = ((20, 0.5), (100, 1.0))
_DURATION = 60.0  # s
_METRICS = ("position_rms", "attitude_rms")


def scenario_of(vehicle: str, law: str, rate: int, sea: float) -> dict:
    """Scenario of a loop."""
    v = VEHICLES[vehicle]
    return {
        "plant": {"vehicle": vehicle, "thruster": v.thruster},
        "model": {"rate_term": True},
        "controller": law,
        "reference": {"kind": "setpoint", "position": [0.0] * 6},
        "disturbance": [
            {"kind": "current", "velocity": list(v.current)},
            {"kind": "waves", "height": sea * v.waves, "period": 5, "depth": 3},
        ],
        "loop": {"dt": 1 / rate, "substeps": 2, "duration": _DURATION, "record": 0.05},
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--laws", default="robust,pid,lqi,adrc,disturbance_observer")
    options = parser.parse_args()
    heads = (f"{name} predicted, simulated" for name in ("mm", "deg"))
    print(f"{'vehicle':<16}{'law':<22}{'Hz':>4}{'sea':>5}  {'  '.join(heads)}  what simulate says")
    within = []
    pairs = itertools.product(VEHICLES, options.laws.split(","))
    for (vehicle, law), (rate, sea) in itertools.product(pairs, CONDITIONS):
        executed = run_scenario(from_data(scenario_of(vehicle, law, rate, sea)))
        prediction = predict(executed)
        steady = executed.steady or {}
        simulated = [float(steady.get(name, np.nan)) for name in _METRICS]
        predicted = [float((prediction.metrics or {}).get(name, np.nan)) for name in _METRICS]
        ratios = np.array(predicted) / np.array(simulated)
        within.append(bool((np.abs(ratios - 1) < 0.2).all()))
        values = zip((1e3, np.degrees(1)), predicted, simulated, strict=True)
        numbers = "  ".join(f"{scale * one:>9.4g} {scale * other:>9.4g}" for scale, one, other in values)
        print(f"{vehicle:<16}{law:<22}{rate:>4}{sea:>5}  {numbers}  {comparison(prediction, executed)}", flush=True)
    print(f"{sum(within)} of {len(within)} loops are predicted within 20 % in both")


if __name__ == "__main__":
    main()
