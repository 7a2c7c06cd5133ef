"""Equilibrium of a closed loop under a constant load, by Newton's method; it need not be stable."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy  # its parts are loaded when they are used
from jaxtyping import Array

from undertow.analysis.linearization.jacobians import Local, Parts, take_apart
from undertow.core.arrays import as_array
from undertow.core.contracts import Measurement, Model
from undertow.core.kept_programs import briefly_compiled
from undertow.physics.plants.reachability import lost_directions
from undertow.simulation.loop.closed_loop import ClosedLoop

_FIRST_SHARE, _SMALLEST_SHARE = 0.25, 0.02  # of a load that is put on little by little
_SETTLING = 400  # sampling times that an actuator is given to come to a force


Names = tuple[str, ...]


class Balance(NamedTuple):
    """The equations of rest.

    Attributes:
        parts: the loop.
        dt: sampling time, s.
        acting: which entries of the plant's state act on anything.
        steered: projection of errors on those that an input can move; others are left to the plant.
    """

    parts: Parts
    dt: float
    acting: np.ndarray
    steered: np.ndarray

    def residual(self, local: Local, at: dict, unknown: Names, still: Names) -> tuple[np.ndarray, np.ndarray]:
        """What must vanish (plant, outputs, law, command), and its slopes with respect to the unknown."""
        values, slopes = local.values, local.slopes
        identity = lambda name, by: np.eye(len(at[name])) if name == by else 0
        equations = {
            "plant": lambda: (values["plant"][self.acting], [slopes["plant"][by][self.acting] for by in unknown]),
            "outputs": lambda: (self.steered @ values["error"], [self.steered @ slopes["error"][by] for by in unknown]),
            "law": lambda: (
                (values["law"] - at["law"]) / self.dt,
                [(slopes["law"][by] - identity("law", by)) / self.dt for by in unknown],
            ),
            "command": lambda: (values["u"] - at["u"], [slopes["u"][by] - identity("u", by) for by in unknown]),
        }
        residuals, rows = zip(*(equations[name]() for name in still), strict=True)
        return np.concatenate(residuals), np.block(list(rows))

    def solve(self, at: dict, unknown: Names, still: Names) -> dict:
        """Vectors from `at` on at which it vanishes: smallest steps, shortened while they make it worse."""

        def look(at: dict):
            residual, jacobian = self.residual(self.parts.differentiate(at, self.dt), at, unknown, still)
            finite = np.isfinite(residual).all() and np.isfinite(jacobian).all()
            return residual, jacobian, float(np.abs(residual).max(initial=0.0)) if finite else np.inf

        residual, jacobian, size = look(at)
        ends = np.cumsum([len(at[name]) for name in unknown])[:-1]
        for _ in range(_STEPS):
            if not _AT_REST < size < np.inf:
                break
            scale = np.abs(jacobian).max(axis=1, keepdims=True)
            scale[scale < _ROUNDING * scale.max()] = 1.0  # scaled up, rounding errors would decide the step
            step = np.split(-_smallest_solution(jacobian / scale, residual / scale[:, 0]), ends)
            best = (residual, jacobian, np.inf)
            trial = at
            for length in _LENGTHS:
                candidate = at | {name: at[name] + length * part for name, part in zip(unknown, step, strict=True)}
                evaluation = look(candidate)
                if evaluation[2] < best[2]:
                    best, trial = evaluation, candidate
                if best[2] < size:
                    break
            if not best[2] < _WORSE * size:  # far from rest a larger residual may still be the way
                break
            rounded = size < _RESTS and best[2] > _SHRINKS * size
            at, (residual, jacobian, size) = trial, best
            if rounded:
                break
        return at


def _smallest_solution(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Least squares, by orthogonal factors: several times as fast as by singular values."""
    solution = scipy.linalg.lstsq(matrix, right, cond=1e-11, lapack_driver="gelsy", check_finite=False)
    assert solution is not None
    return np.asarray(solution[0])


class Equilibrium(NamedTuple):
    """A loop at rest.

    Attributes:
        parts: the loop.
        at: vectors of states, input, load; see `Parts.differentiate`.
        local: values and slopes there.
        moving: what still moves, largest rate in SI units; not small where no input can hold the load.
        acting: which entries of the plant's state act on anything; the others (counters of energy) only follow.
    """

    parts: Parts
    at: dict[str, np.ndarray]
    local: Local
    moving: float
    acting: np.ndarray

    @property
    def found(self) -> bool:
        """Whether it rests."""
        return self.moving < _RESTS


def equilibrium(
    loop: ClosedLoop, dt: float, position: Any, load: Any, flow: Any = None, near: Equilibrium | None = None
) -> Equilibrium:
    """The loop at rest at a reference, under a constant load.

    Args:
        loop: the five roles; reference, disturbance and sensor are left out.
        dt: sampling time, s.
        position: of the reference, m and rad.
        load: acceleration of the outputs, m/s^2 and rad/s^2.
        flow: velocity of the water past the vehicle, m/s, world axes: what of the load it causes changes as the vehicle
            turns and moves. None: the load stays what it is.
        near: that of the same plant under this load with another law of the same kind, whose plant and input rest
            where these do. It is where the search begins: several times as fast.
    """
    parts, start = take_apart(loop, position, flow)
    load, model = np.asarray(load, dtype=float), parts.loop.controller.model.in_body_axes()
    y = _output(parts, as_array(start["plant"]))
    balance = Balance(parts, dt, _acting(parts.differentiate(start, dt)), _steered(model, y))
    if near is not None:
        held = _together(balance, balance.solve(near.at, unknown=("law",), still=("law",)))
        if held.found:
            return held
    holding = lambda load: np.asarray(_settled_input(model, y, as_array(load)))
    from_afar = lambda load: _from_afar(balance, start | {"load": load, "u": holding(load)})
    at_full_load = from_afar(load)
    # Where that fails, the load is put on little by little, from a share that can be held.
    share, step = 0.0, _FIRST_SHARE
    held = at_full_load if at_full_load.found else from_afar(share * load)
    while not at_full_load.found and held.found and step > _SMALLEST_SHARE:
        further = _together(balance, held.at | {"load": min(1.0, share + step) * load})
        if further.found:
            share, held = min(1.0, share + step), further
            at_full_load = held if share == 1.0 else at_full_load
        else:
            step /= 2
    return at_full_load


@briefly_compiled
def _output(parts: Parts, state: Array) -> Measurement:
    return parts.loop.plant.output(jnp.zeros(()), parts.plant_state(state))


def _from_afar(balance: Balance, at: dict) -> Equilibrium:
    """Start from actuators that stand still, with an input that is about right.

    The plant first, so that actuators turn (with the input held, else the shortest way to rest is to switch them off);
    then what the law learns and believes at that plant; then both together.
    """
    at = balance.solve(at, unknown=("plant",), still=("plant", "outputs"))
    at = balance.solve(at, unknown=("plant", "u"), still=("plant", "outputs"))
    at = balance.solve(at, unknown=("law",), still=("law",))
    return _together(balance, at)


def _together(balance: Balance, at: dict) -> Equilibrium:
    """Equilibrium of plant and law from a point near it."""
    unknown, still = ("plant", "law", "u"), ("plant", "law", "command")
    at = balance.solve(at, unknown, still)
    local = balance.parts.differentiate(at, balance.dt)
    remaining = balance.residual(local, at, unknown, still)[0]
    return Equilibrium(balance.parts, at, local, float(np.abs(remaining).max(initial=0.0)), balance.acting)


def _steered(model: Model, y: Measurement) -> np.ndarray:
    """Projection of the outputs on what some input accelerates; one where that is everything."""
    into_axes, effect = _reach(model, y)
    lost = lost_directions(np.linalg.solve(np.asarray(into_axes), np.asarray(effect)))
    return np.eye(len(into_axes)) - np.linalg.pinv(lost) @ lost


@briefly_compiled
def _reach(model: Model, y: Measurement):
    """From accelerations of the outputs to the axes of the law; and what the forces give there."""
    into_axes = jax.jacfwd(lambda a: model.coordinates.acceleration(y, a))(jnp.zeros_like(y.position))
    return into_axes, model.dynamics.gain(y)


@briefly_compiled
def _settled_input(model: Model, y: Measurement, load):
    """Input that gives the forces against drift and load, once the actuators have come to them."""
    dynamics, coordinates, drive = model
    load_acceleration = coordinates.acceleration(y, load) - coordinates.acceleration(y, jnp.zeros_like(load))
    forces = dynamics.invert(y, -dynamics.drift(y) - load_acceleration)
    rate, step = jnp.asarray(20.0), jnp.asarray(5e-3)
    settle = lambda _, state: drive.advance(state, drive.command(state, forces, rate), step)
    return drive.command(jax.lax.fori_loop(0, _SETTLING, settle, drive.init()), forces, rate)


def _acting(local: Local) -> np.ndarray:
    """Entries of the plant's state that something else depends on."""
    acts = np.ones(len(local.values["plant"]), dtype=bool)
    other_slopes = [slopes["plant"] for name, slopes in local.slopes.items() if name not in ("plant", "law", "flow")]
    while True:
        rows = np.vstack([local.slopes["plant"]["plant"][acts], local.slopes["law"]["plant"], *other_slopes])
        extended = acts & (rows != 0).any(axis=0)
        if (extended == acts).all():
            return acts
        acts = extended


_STEPS = 30
_ROUNDING = 1e-13  # slopes below this share of the largest one are rounding errors
_LENGTHS = (1.0, 0.5, 0.25, 0.1)  # of a step
_WORSE = 1e3  # times the residual before: further than this nothing is looked for
_AT_REST = 1e-8  # of what moves, in SI units; no step is taken below it
_RESTS = 1e-5  # the same, of an equilibrium
_SHRINKS = 0.9  # share of it that a step of such a point leaves; more is rounding
