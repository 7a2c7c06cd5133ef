"""Wrong readings of one sensor at a time, of any size and up to a second long: what they do to a navigation filter.

    python benchmarks/navigation_glitches.py [--glitches 200] [--seed 1] [--filter kalman]

A BlueROV2 Heavy moves and rolls. Each glitch adds an offset to one entry of the readings of an IMU (inclination,
gyroscopes, accelerometers), a DVL, a depth sensor, a compass or an acoustic position fix; its size is log-uniform from
ten standard deviations of the noise up to full scale, its duration log-uniform from a sample to 1 s. The table has, by
target, the largest error of velocity and attitude in the 60 s afterwards, the time with an error above 0.2 m/s, and the
good readings that were rejected: of the worst glitch, and of the 95 % quantile (errors) or the mean (others). The last
column is how often all gates were opened. A minute or two on one core.
"""

import argparse
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.control.navigation.from_sensors import AbstractFilter
from undertow.core.measurement import body_of, measurement_of_outputs, measurement_of_pose
from undertow.physics.sensors.received import Received
from undertow.scenario.build import build
from undertow.scenario.reading import from_data

STEP, BEFORE, AFTER = 0.01, 20.0, 60.0  # s
LARGE = 0.2  # m/s, error of the velocity that is counted
AMPLITUDE = np.array([2.0, 1.0, 0.5, 0.1, 0.07, 0.8])  # m, rad
FREQUENCY = np.array([0.2, 0.4, 0.3, 1.2, 0.9, 0.25])  # rad/s
SENSORS = {  # with the steps between readings and the noise of each entry
    "imu": (1, np.repeat([5e-3, 2e-3, 0.02], [2, 3, 3])),
    "dvl": (12, np.full(3, 5e-3)),
    "depth": (10, np.full(1, 5e-3)),
    "compass": (10, np.full(1, 0.01)),
    "position_fix": (100, np.full(2, 0.05)),
}
TARGETS = {  # sensor, its entries, full scale
    "inclination": ("imu", (0, 1), np.pi / 2),  # rad
    "gyroscopes": ("imu", (2, 3, 4), 35.0),  # rad/s
    "accelerometers": ("imu", (5, 6, 7), 160.0),  # m/s^2
    "DVL": ("dvl", (0, 1, 2), 20.0),  # m/s
    "depth": ("depth", (0,), 300.0),  # m
    "compass": ("compass", (0,), np.pi),  # rad
    "fixes": ("position_fix", (0, 1), 1e4),  # m
}


class Glitch(NamedTuple):
    """Offset of one entry of the readings of a sensor."""

    target: str
    entry: int
    size: float  # in the unit of the entry
    duration: float  # s

    def offset(self, sensor: str) -> np.ndarray:
        """What it adds to a reading of a sensor."""
        width = len(SENSORS[sensor][1])
        return self.size * np.eye(width)[self.entry] if TARGETS[self.target][0] == sensor else np.zeros(width)


class Damage(NamedTuple):
    """What a glitch did, up to now."""

    velocity: Any  # m/s, largest error
    attitude: Any  # rad
    large: Any  # s with more than 0.2 m/s
    rejected: Any  # good readings
    reopened: Any  # times that all gates opened


def scenario(kind: str) -> dict[str, Any]:
    """The vehicle, and its sensors as they are simulated here."""
    sensors = [
        {"kind": "imu", "period": STEP},
        {"kind": "dvl", "period": 12 * STEP, "noise": 5e-3, "resolution": 0, "delay": 0},
        {"kind": "depth", "period": 10 * STEP, "noise": 5e-3, "resolution": 0},
        {"kind": "compass", "period": 10 * STEP, "noise": 0.01},
        {"kind": "position_fix", "period": 1, "noise": 0.05, "delay": 0},
    ]
    return {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},  # V
        "controller": "robust",
        "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
        "navigation": {"kind": kind, "sensors": sensors},
        "loop": {"duration": 1, "dt": STEP},
    }


def motions() -> dict[str, np.ndarray]:
    """The true motion at every step, and what each sensor would read."""

    def motion(t):
        position, velocity = AMPLITUDE * jnp.sin(FREQUENCY * t), AMPLITUDE * FREQUENCY * jnp.cos(FREQUENCY * t)
        body = body_of(measurement_of_outputs(position, velocity))
        middle = t - STEP / 2  # accelerometers read the mean since the last step
        turned = body_of(measurement_of_outputs(AMPLITUDE * jnp.sin(FREQUENCY * middle), velocity)).rotation
        acceleration = -AMPLITUDE[:3] * FREQUENCY[:3] ** 2 * jnp.sin(FREQUENCY[:3] * middle)
        force = turned.T @ (acceleration - jnp.array([0.0, 0.0, 9.81]))
        return {
            "position": position,
            "attitude": body.attitude,
            "nu": body.nu,
            "imu": jnp.concatenate([position[3:5], body.nu[3:], force]),
            "dvl": body.nu[:3],
            "depth": position[2:3],
            "compass": position[5:],
            "position_fix": position[:2],
        }

    times = STEP * np.arange(round((BEFORE + AFTER) / STEP) + 1)
    return jax.tree.map(np.asarray, jax.vmap(motion)(jnp.asarray(times)))


def random_glitch(rng: np.random.Generator) -> Glitch:
    """A random glitch."""
    target = rng.choice(list(TARGETS))
    sensor, entries, full_scale = TARGETS[target]
    every, noise = SENSORS[sensor]
    entry = int(rng.choice(entries))
    size = np.exp(rng.uniform(np.log(10 * noise[entry]), np.log(full_scale))) * rng.choice([-1, 1])
    return Glitch(target, entry, size, float(np.exp(rng.uniform(np.log(every * STEP), 0.0))))


@eqx.filter_jit
def damages(own: AbstractFilter, truth: dict[str, Any], noise: dict[str, Any], offsets: dict[str, Any], durations: Any):
    """What each glitch does from `BEFORE` on."""
    begin = round(BEFORE / STEP)
    counts = lambda state: (own.diagnostics(state) if own.signals() else {}) | {"none": jnp.zeros((), dtype=int)}
    rejections = lambda found: sum(found.get(name, 0) for name in ("rejected_readings", "rejected_inertial"))

    def follow(offset, duration):
        def step(carry, k):
            state, damage = carry
            received, wrong = [], jnp.zeros((), dtype=int)
            for name, (every, _) in SENSORS.items():
                since = (k - _onset(begin, every)) * STEP
                hit = (since >= 0) & (since < duration - 1e-9) & (offset[name] != 0).any()
                reading = truth[name][k] + noise[name][k] + jnp.where(hit, offset[name], 0.0)
                received.append(Received(reading, k % every == 0, jnp.zeros(())))
                wrong = wrong + jnp.where(hit & (k % every == 0), 1, 0)
            after = own.update(state, jnp.asarray(STEP), tuple(received))
            found = own.measurement(after)
            velocity = jnp.linalg.norm(found.body.nu[:3] - truth["nu"][k, :3])
            angle = 2 * jnp.arccos(jnp.minimum(1.0, jnp.abs((found.body.attitude * truth["attitude"][k]).sum())))
            rejected = rejections(counts(after)) - rejections(counts(state))
            counted = k >= begin
            damage = Damage(
                jnp.where(counted, jnp.maximum(damage.velocity, velocity), 0.0),
                jnp.where(counted, jnp.maximum(damage.attitude, angle), 0.0),
                damage.large + jnp.where(counted & (velocity > LARGE), STEP, 0.0),
                damage.rejected + jnp.where(counted, jnp.maximum(rejected - wrong, 0), 0),  # one is the wrong one
                jnp.asarray(counts(after).get("reopened_gates", 0)),
            )
            return (after, damage), None

        at_first = measurement_of_pose(truth["position"][0, :3], truth["attitude"][0], truth["nu"][0], None)
        zero, none = jnp.zeros(()), jnp.zeros((), dtype=int)
        start = own.start(at_first), Damage(zero, zero, zero, none, none)
        return jax.lax.scan(step, start, jnp.arange(1, len(truth["position"])))[0][1]

    return jax.vmap(follow)(offsets, durations)


def _onset(begin: int, every: int) -> int:
    """The first step from `begin` on with a reading of a sensor."""
    return -(-begin // every) * every


def row(name: str, found: Damage) -> str:
    """A line of the table."""
    both = lambda values: f"{values.max():.2f}, {np.quantile(values, 0.95):.2f}"
    mean = lambda values, digits: f"{values.max():.{digits}f}, {values.mean():.{digits}f}"
    return (
        f"| {name} | {len(found.velocity)} | {both(found.velocity)} | {both(found.attitude)} | {mean(found.large, 1)} "
        f"| {mean(found.rejected, 0)} | {int(found.reopened.sum())} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--glitches", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--filter", default="kalman", choices=["kalman", "observer"])
    parser.add_argument("--worst", type=int, default=0, help="print that many of the worst glitches")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    with jax.enable_x64(True):
        own, truth = build(from_data(scenario(options.filter))).closed_loop.navigation.filter, motions()
        steps = len(truth["position"])
        noise = {name: each * rng.normal(size=(steps, len(each))) for name, (_, each) in SENSORS.items()}
        glitches = [random_glitch(rng) for _ in range(options.glitches)]
        offsets = {name: np.stack([one.offset(name) for one in glitches]) for name in SENSORS}
        durations = np.array([one.duration for one in glitches])
        found = jax.tree.map(np.asarray, damages(own, truth, noise, offsets, durations))
    print("| target | glitches | velocity (m/s) | attitude (rad) | above 0.2 m/s (s) | good rejected | reopened |")
    print("|---|---|---|---|---|---|---|")
    targets = np.array([one.target for one in glitches])
    for target in TARGETS:
        if (targets == target).any():
            print(row(target, jax.tree.map(lambda values, of=targets == target: values[of], found)))
    print(row("all", found))
    for i in np.argsort(-found.velocity)[: options.worst]:
        print(glitches[i], *(f"{name} {values[i]:.3g}" for name, values in found._asdict().items()))


if __name__ == "__main__":
    main()
