"""What a replay shows of one run, as arrays, and its compact form for the page.

World axes north, east, down; body axes forward, starboard, down; attitudes as quaternions (w, x, y, z), body to world.
The script turns these axes into those of the screen.
"""

import base64
import json
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from undertow.core import runtime
from undertow.core.contracts import AbstractPlant
from undertow.core.measurement import BODY_AXES, BODY_OUTPUTS
from undertow.core.numerics.rotations import quaternion_from_euler, rotation_from_quaternion
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.vehicles.facts import facts_of
from undertow.physics.vehicles.vehicle import VehicleModel
from undertow.report.replay.recomputed import environment, firing_along, thrust_along, thrust_limits
from undertow.simulation.loop.closed_loop import ClosedLoop

COLOURS = ("#0072b2", "#e07b00", "#009e73", "#cc79a7")  # of several runs; safe for colour-blind readers

FRAMES = 2400  # at most: two minutes at the fastest
_FASTEST = 0.05  # s between frames
_FEW = 200  # frames that a short run has at least, if it has as many records
_VALUES = 80_000  # of one series in the page
_THINNEST = 0.12  # share of its longest side that a vehicle is at least thick


class Thrusters(NamedTuple):
    """Thrusters of a vehicle, body axes."""

    names: tuple[str, ...]
    positions: np.ndarray  # m, shape (N, 3)
    directions: np.ndarray  # of positive thrust, shape (N, 3)
    limits: np.ndarray  # N, shape (N, 2): reverse (negative) and forward


class ReplayData(NamedTuple):
    """One run to be shown.

    Attributes:
        label: name of the run.
        status: how it ended.
        time: of the frames, s, evenly spaced.
        size: length, width and height of the vehicle, m.
        thrusters: where they are.
        limited: whether `limits` are those of the input; else they are the largest thrust of the run.
        body_axes: whether uncertainty and estimate are in body axes, else in the axes of the outputs.
        series: values by name, shape (frames, components); see `SERIES`.
    """

    label: str
    status: str
    time: np.ndarray
    size: np.ndarray
    thrusters: Thrusters
    limited: bool
    body_axes: bool
    series: dict[str, np.ndarray]


# Series of a replay -> bytes of one value in the page, and meaning. The last four are there where the run has them.
SERIES = {
    "position": (2, "north, east, down, m"),
    "attitude": (2, "quaternion, body to world"),
    "desired_position": (2, "north, east, down, m"),
    "desired_attitude": (2, "quaternion, body to world"),
    "thrust": (2, "of each thruster, N"),
    "error": (2, "norm of the tracking error: m, degrees"),
    "energy": (2, "electrical energy since the start, J"),
    "uncertainty": (2, "lumped uncertainty of each axis, m/s^2, rad/s^2"),
    "estimate": (2, "its estimate by the controller"),
    "water": (2, "velocity of the water at the vehicle: north, east, down, m/s"),
    "weights": (1, "weight of each fuzzy rule, axis by axis, m/s^2, rad/s^2"),
    "firing": (1, "fuzzy basis function of each rule, axis by axis"),
}


def can_be_shown(plant: AbstractPlant) -> bool:
    """Whether a replay can show runs of a plant: a vehicle with thrusters."""
    return isinstance(plant, HybridVehicle)


def replay_of(
    run: xr.Dataset, loop: ClosedLoop, seed: int, hull: Sequence[float] | None, label: str = ""
) -> ReplayData | None:
    """What a replay shows of a run; None for a plant that is no vehicle with thrusters, or a single record.

    Args:
        run: recorded series.
        loop: the closed loop that was run.
        seed: of the run.
        hull: length, width and height of the vehicle, m; None where they are not known.
        label: name of the run, for a replay of several.
    """
    plant = loop.plant
    if not isinstance(plant, HybridVehicle) or run.sizes["time"] < 2:
        return None
    valid_run = run.isel(time=slice(0, max(2, int((run["time"].values <= run.attrs.get("ended", np.inf)).sum()))))
    valid_run = valid_run.map(_finite)
    with runtime.on_processor(), runtime.in_precision(str(valid_run["position"].dtype)):
        return _replay_of(valid_run, loop, plant, seed, hull_size(plant.vehicle, hull), label)


def _replay_of(
    run: xr.Dataset, loop: ClosedLoop, plant: HybridVehicle, seed: int, size: np.ndarray, label: str
) -> ReplayData:
    time = run["time"].values
    frames = _frames(run["time"].values)
    records = run.isel(time=frames)
    position, reference = records["position"].values, records["reference"].values
    surroundings = environment(loop, seed, records["time"].values, position, records["velocity"].values)
    step = float(time[1] - time[0])
    acting_input = run["acting_input" if "acting_input" in run else "input"].values
    thrust = _finite_values(thrust_along(plant.thruster, acting_input, step)[frames])
    if surroundings.thrust_share is not None:
        thrust = thrust * surroundings.thrust_share
    error = records["error"].values
    energy = _energy(run)[frames]
    series = {
        "position": position[:, :3],
        "attitude": _attitude(position[:, 3:]),
        "desired_position": reference[:, :3],
        "desired_attitude": _attitude(reference[:, 3:]),
        "thrust": thrust,
        "error": np.stack([_norm(error[:, :3]), np.degrees(_norm(error[:, 3:]))], axis=-1),
        "energy": energy[:, None],
        "uncertainty": records["uncertainty"].values,
    }
    optional = {
        "estimate": records["estimate"].values if "estimate" in records else None,
        "water": surroundings.water,
        "weights": records["weights"].values.reshape(len(frames), -1) if "weights" in records else None,
        "firing": firing_along(loop.controller, records),
    }
    series |= {
        name: _finite_values(values.reshape(len(frames), -1)) for name, values in optional.items() if values is not None
    }
    return ReplayData(
        label=label,
        status=str(run.attrs.get("status", "")),
        time=records["time"].values,
        size=size,
        series=series,
        **_kept_of(loop, plant, thrust),
    )


def _energy(run: xr.Dataset) -> np.ndarray:
    """Electrical energy since the start, J, as the metric `energy` has it: of the ledger, or by the trapezium rule."""
    if "energy_source" in run:
        return run["energy_source"].values
    time = run["time"].values
    power = run["power"].values.sum(-1)
    return np.concatenate([[0.0], np.cumsum(np.diff(time) * (power[1:] + power[:-1]) / 2)])


def _frames(time: np.ndarray) -> np.ndarray:
    """Numbers of the records to show, first and last included: evenly spaced, as far as they lie evenly."""
    span = float(time[-1] - time[0])
    count = min(len(time) - 1, FRAMES, max(_FEW, int(np.ceil(span / _FASTEST - 1e-6))))
    return np.round(np.linspace(0, len(time) - 1, count + 1)).astype(int)


def _finite(variable: xr.DataArray) -> xr.DataArray:
    return variable.copy(data=_finite_values(variable.values)) if variable.dtype.kind == "f" else variable


def _finite_values(values: np.ndarray) -> np.ndarray:
    """Values with the last finite one in place of those that are not; zero before the first."""
    valid = np.isfinite(values)
    if valid.all():
        return values
    numbers = np.arange(len(values)).reshape(-1, *[1] * (values.ndim - 1))
    last = np.maximum.accumulate(np.where(valid, numbers, -1), axis=0)
    return np.where(last < 0, 0.0, np.take_along_axis(np.where(valid, values, 0.0), np.maximum(last, 0), axis=0))


def _norm(values: np.ndarray) -> np.ndarray:
    return np.sqrt((values**2).sum(-1))


_quaternions = jax.jit(jax.vmap(quaternion_from_euler))


def _attitude(angles: np.ndarray) -> np.ndarray:
    """Quaternions of (roll, pitch, yaw), each on the side of the one before, so that between them is the short way."""
    quaternions = np.asarray(_quaternions(jnp.asarray(angles)))
    flips = np.where((quaternions[1:] * quaternions[:-1]).sum(-1) < 0, -1.0, 1.0)
    return quaternions * np.concatenate([[1.0], np.cumprod(flips)])[:, None]


def rotations(attitude: np.ndarray) -> np.ndarray:
    """Rotations, body to world, of quaternions of shape (frames, 4)."""
    with runtime.on_processor():
        return np.asarray(jax.vmap(rotation_from_quaternion)(jnp.asarray(attitude)))


def _limits(plant: HybridVehicle, thrust: np.ndarray) -> tuple[np.ndarray, bool]:
    """Largest thrust in reverse and forward, N, shape (N, 2), and whether it is that of the limited input."""
    limits = thrust_limits(plant.thruster, plant.inputs())
    if np.isfinite(limits).all() and (limits[:, 0] < 0).all() and (limits[:, 1] > 0).all():
        return limits, True
    most = max(float(np.abs(thrust).max()), 1e-9)
    return np.tile([-most, most], (plant.inputs(), 1)), False


def hull_size(vehicle: VehicleModel, dimensions: Sequence[float] | None) -> np.ndarray:
    """Length, width and height, m: the known ones, or those of the even box of the same mass and inertia."""
    if dimensions is not None:
        return np.asarray(dimensions, dtype=float)
    facts = facts_of(vehicle)
    moments_of_inertia = np.diag(facts.inertia)
    sides = np.sqrt(np.maximum(6 * (moments_of_inertia.sum() - 2 * moments_of_inertia) / facts.mass, 0.0))
    return np.maximum(sides, _THINNEST * max(float(sides.max()), facts.scale))


def page_data(replays: Sequence[ReplayData]) -> str:
    """All that the script of the page needs, as JSON that may stand inside a script element."""
    return page_json({"runs": [_described(replay, COLOURS[i % len(COLOURS)]) for i, replay in enumerate(replays)]})


def page_json(data: Any) -> str:
    """Plain data as JSON that may stand inside a script element."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def vehicle_alone(loop: ClosedLoop, hull: Sequence[float] | None) -> dict[str, Any]:
    """What a script needs that shows a vehicle without a run: as a run of `page_data`, with no series."""
    plant: Any = loop.plant
    replay = ReplayData(
        label="",
        status="",
        time=np.zeros(1),
        size=hull_size(plant.vehicle, hull),
        series={},
        **_kept_of(loop, plant, np.zeros(plant.inputs())),
    )
    return _described(replay, COLOURS[0])


def _kept_of(loop: ClosedLoop, plant: HybridVehicle, thrust: np.ndarray) -> dict[str, Any]:
    """Fields of a replay that are of the vehicle and its controller."""
    limits, limited = _limits(plant, thrust)
    vehicle = plant.vehicle
    positions, directions = np.asarray(vehicle.thruster_positions), np.asarray(vehicle.thruster_directions)
    return {
        "thrusters": Thrusters(vehicle.thruster_names(), positions, directions, limits),
        "limited": limited,
        "body_axes": bool(loop.controller.model.coordinates.axes),
    }


def _described(replay: ReplayData, colour: str) -> dict[str, Any]:
    names, positions, directions, limits = replay.thrusters
    numbers = lambda values: np.round(np.asarray(values, dtype=float), 5).tolist()
    return {
        "label": replay.label,
        "colour": colour,
        "status": replay.status,
        "start": float(replay.time[0]),
        "end": float(replay.time[-1]),
        "size": numbers(replay.size),
        "thrusters": [
            {"name": name, "position": numbers(position), "direction": numbers(direction), "limits": numbers(limit)}
            for name, position, direction, limit in zip(names, positions, directions, limits, strict=True)
        ],
        "limited": replay.limited,
        "axes": BODY_AXES if replay.body_axes else BODY_OUTPUTS,
        "body_axes": replay.body_axes,
        "series": {name: packed(_thinned(values), SERIES[name][0]) for name, values in replay.series.items()},
    }


def _thinned(values: np.ndarray) -> np.ndarray:
    """A series of few enough values: of many rules, fewer frames, the first and the last among them."""
    most = max(2, _VALUES // values.shape[1])
    return values if len(values) <= most else values[np.round(np.linspace(0, len(values) - 1, most)).astype(int)]


def packed(values: np.ndarray, size: int) -> dict[str, Any]:
    """A series in few bytes: each component as whole numbers between its smallest and its largest value.

    Args:
        values: finite, shape (frames, components).
        size: bytes of one value, 1 or 2; the error is at most half of 1/255 or 1/65535 of the range.
    """
    low, high = values.min(axis=0).astype(float), values.max(axis=0).astype(float)
    levels = 256**size - 1
    width = np.where(high > low, high - low, 1.0)
    integers = np.round((values - low) / width * levels).astype(f"<u{size}")
    rounded = lambda limits: [float(f"{limit:.9g}") for limit in limits]
    return {
        "bytes": size,
        "low": rounded(low),
        "high": rounded(high),
        "data": base64.b64encode(integers.tobytes()).decode(),
    }
