"""Steps per second of the Gymnasium environments: BlueROV2 Heavy, motors included, 20 Hz with five RK4 steps each.

    python benchmarks/gymnasium_steps.py [--seconds 3] [--json]

A step is one control step of one environment: action, five integration steps, measurement, observation, reward.
"""

import argparse
import json
import time

import numpy as np

from undertow.outside import gymnasium as ug

COUNTS = (1, 64, 4096)


def steps_per_second(count: int, seconds: float) -> dict[str, float]:
    """Steps per second of `count` environments, and the seconds of making and of resetting them."""
    begun = time.perf_counter()
    env = ug.make_vec(ug.BLUEROV2_HEAVY, count)
    made = time.perf_counter()
    env.reset(seed=0)
    reset = time.perf_counter()
    actions = np.random.default_rng(0).uniform(-0.1, 0.1, size=(count, 8))
    steps, until = 0, time.perf_counter() + seconds
    start = time.perf_counter()
    while (now := time.perf_counter()) < until:
        env.step(actions)
        steps += 1
    return {"steps_per_s": count * steps / (now - start), "made_s": made - begun, "reset_s": reset - made}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=3.0, help="of stepping, for each number of environments")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    found = {count: steps_per_second(count, given.seconds) for count in COUNTS}
    if given.json:
        print(json.dumps(found, indent=2))
        return
    print(f"{'environments':>12}{'steps/s':>12}{'made in, s':>12}{'reset in, s':>12}")
    for count, row in found.items():
        print(f"{count:12}{row['steps_per_s']:12.0f}{row['made_s']:12.1f}{row['reset_s']:12.3f}")


if __name__ == "__main__":
    main()
