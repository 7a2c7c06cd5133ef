"""What `undertow identify` says of logs that are wrong: refused, named, or a result that is not believed.

A simulated dive of a BlueROV2 Heavy whose drag differs from the file is spoilt in one way after the other. A log that
the checks do not refuse is identified; its verdict is shown, and the largest error of a drag in stated deviations.
`python benchmarks/identification_attacks.py`.
"""

from collections.abc import Callable

import numpy as np

import undertow as ut
from undertow.core.errors import BadInput
from undertow.core.runtime import in_precision
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.report.answers.identification_answer import answer_of_identification
from undertow.studies.identification.simulated_dive import telegraph_dive

TRUTH = {"quadratic_damping.surge": 110.0, "quadratic_damping.sway": 170.0, "quadratic_damping.heave": 240.0}
HEAVIER = TRUTH | {"added_mass.surge": 150.0, "added_mass.sway": 170.0, "added_mass.heave": 250.0}
SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": "robust",
    "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
    "loop": {"dt": 0.01, "duration": 1},
}
DURATION = 60.0  # s


def dive(truth: dict[str, float]) -> Log:
    """The log of a dive in which the thrusters jump at random."""
    with in_precision("float64"):
        return telegraph_dive(hybrid_vehicle(bluerov2_heavy(), t200()), truth, 0, DURATION)


def values(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Log], Log]:
    """An attack on the values of a signal."""

    def attack(log: Log) -> Log:
        series = log[name]
        return _with(log, name, series._replace(values=change(series.values.copy())))

    return attack


def late(name: str, delay: float) -> Callable[[Log], Log]:
    """An attack on the times of a signal, s."""

    def attack(log: Log) -> Log:
        series = log[name]
        return _with(log, name, series._replace(time=series.time + delay))

    return attack


def _with(log: Log, name: str, series: Series) -> Log:
    return Log({**log.signals, name: series}, log.source, log.format)


def _columns(change: Callable[[np.ndarray], None]) -> Callable[[np.ndarray], np.ndarray]:
    def changed(array: np.ndarray) -> np.ndarray:
        change(array)
        return array

    return changed


def _swap(array: np.ndarray) -> None:
    array[:, [0, 1]] = array[:, [1, 0]]


def _negate_third(array: np.ndarray) -> None:
    array[:, 2] *= -1


def _without_yaw(array: np.ndarray) -> None:
    array[:, 2] = 0.0


def _stuck(array: np.ndarray) -> None:
    array[len(array) // 3 :] = array[len(array) // 3]


def _outliers(array: np.ndarray) -> None:
    generator = np.random.default_rng(1)
    hit = generator.random(len(array)) < 0.1
    array[hit] += generator.normal(size=(hit.sum(), array.shape[1]))


ATTACKS: dict[str, Callable[[Log], Log]] = {
    "none": lambda log: log,
    "inputs 0.3 s late": late("input", 0.3),
    "inputs of another clock, an hour": late("input", 3600.0),
    "rates 0.3 s late": late("angular_velocity", 0.3),
    "velocity 0.1 s late": late("body_velocity", 0.1),
    "thruster 3 with the wrong sign": values("input", _columns(_negate_third)),
    "thrusters 1 and 2 swapped": values("input", _columns(_swap)),
    "attitude in degrees": values("attitude", np.degrees),
    "rates in degrees per second": values("angular_velocity", np.degrees),
    "z of the position up": values("position", lambda array: array * [1, 1, -1]),
    "w with the wrong sign": values("body_velocity", lambda array: array * [1, 1, -1]),
    "yaw missing (zero)": values("attitude", _columns(_without_yaw)),
    "velocity stuck": values("body_velocity", _columns(_stuck)),
    "rates stuck": values("angular_velocity", _columns(_stuck)),
    "10 % outliers in the velocity": values("body_velocity", _columns(_outliers)),
    "10 % outliers in the attitude": values("attitude", _columns(_outliers)),
    "a much heavier vehicle": lambda log: dive(HEAVIER),
}


def main() -> None:
    """Print the table."""
    unspoilt = dive(TRUTH)
    for name, attack in ATTACKS.items():
        print(f"{name}: {_outcome(attack(unspoilt))}", flush=True)


def _outcome(log: Log) -> str:
    try:
        model = ut.identify(SCENARIO, log, priors={"mass": "13.5 +- 0.1"})
    except BadInput as error:
        return f"refused. {error}"
    found = model.parameters
    errors = [abs(found[name].value - value) / found[name].deviation for name, value in TRUTH.items() if name in found]
    largest = f"largest error of a drag {max(errors):.1f} deviations" if errors else "no drag identified"
    answer = answer_of_identification(model.data)
    said = " ".join(finding for finding in model.result.findings) or "nothing"
    return f"{largest}. {answer.verdict} Said: {said}"


if __name__ == "__main__":
    main()
