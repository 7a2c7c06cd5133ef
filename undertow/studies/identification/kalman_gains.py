"""A Kalman filter along the segments of dives: its gains, and how likely the measurements are.

Besides its thrusters something unknown pushes the vehicle: accelerations in six axes, each a Gauss-Markov process. The
covariance follows the equations of an extended Kalman filter whose state is a small change: of position, a turn in body
axes, of velocity and angular velocity, and of the push; Simon (2006), sections 7.2 (coloured noise) and 13.2. What the
actuators do is known. The push is an acceleration and no force: with gains in newtons, an estimate would choose the
mass that makes the filter fast.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.studies.identification.dive import SENSOR_OF_RESIDUAL
from undertow.studies.identification.model import IdentificationModel
from undertow.studies.identification.prediction import DisturbedMotion, begin, between, disturbed, step_and_difference
from undertow.studies.identification.segments import START_DEVIATION, Segments

# From a change of the state to that of the residuals: north, east, down; roll, pitch, yaw; u, v, w; p, q, r; depth.
_MEASURED = np.vstack([np.eye(12, 18), np.eye(12, 18)[2:3]])


class Disturbance(NamedTuple):
    """What pushes the vehicle besides its thrusters.

    Attributes:
        deviations: standard deviation of the acceleration in each axis, m/s^2 and rad/s^2, (6,).
        correlation_time: s.
    """

    deviations: Any
    correlation_time: Any

    def kept(self, step) -> Any:
        """Share of a push that is left after a step."""
        return jnp.exp(-step / self.correlation_time)


class FilterRun(NamedTuple):
    """What a filter did in each step of each segment.

    Attributes:
        gains: from innovations to a change of the state, (S, length, 18, 13).
        whitening: from innovations to white noise of variance 1, (S, length, 13, 13).
        innovations: predicted less measured, (S, length, 13); 0 without a sample.
        transitions: of a change of the state over a step, (S, length, 18, 18).
        pushes: estimated at the begin of the step, m/s^2 and rad/s^2, (S, length, 6).
        offsets: of the samples after the begin of the step, as a share of it, (S, length, 13).
    """

    gains: Any
    whitening: Any
    innovations: Any
    transitions: Any
    pushes: Any
    offsets: Any


def with_filter(
    model: IdentificationModel, z, segments: Segments, weights: np.ndarray, disturbance: Disturbance, step: float
) -> tuple[Segments, FilterRun]:
    """Segments with the gains of a filter, and what it did.

    Args:
        model: see there.
        z: unknowns.
        segments: of the dives.
        weights: of the samples, 1/variance, 0 without one, (S, length, 13).
        disturbance: see there.
        step: s.
    """
    kept = np.full(len(segments.dive), float(disturbance.kept(step)))
    free = segments._replace(gains=None, whitening=None, push_kept=None)
    run = _filter_runs(model, jnp.asarray(z), free, jnp.asarray(weights), jax.tree.map(jnp.asarray, disturbance), step)
    run = FilterRun(*map(np.asarray, run))
    return segments._replace(gains=run.gains, whitening=run.whitening, push_kept=kept), run


@eqx.filter_jit
def _filter_runs(model: IdentificationModel, z, segments: Segments, weights, disturbance, step) -> FilterRun:
    candidate = model.candidate(z)
    kept = disturbance.kept(step)

    def of_segment(segment, weight) -> FilterRun:
        vehicle, sensing = candidate.vehicle, candidate.sensing(segment.dive)
        start, inputs = begin(vehicle, sensing, segment, step)

        def advance(state, row):
            x, covariance = state
            u, measured, weight = row
            after, difference = step_and_difference(vehicle, sensing, x, u, measured, kept, step)
            innovation = jnp.where(weight > 0, difference, 0.0)

            def change_after(change):
                begun = disturbed(x, change)
                motion = vehicle.advance(begun.motion, u, sensing.current, step, begun.push)
                return between(after, DisturbedMotion(motion, kept * begun.push))

            transition = jax.jacfwd(change_after)(jnp.zeros(18))
            offsets = measured[1][jnp.asarray(SENSOR_OF_RESIDUAL)]
            update = _updated(transition, covariance, weight, offsets, disturbance, kept)
            corrected = disturbed(after, -update.gain @ innovation)
            done = FilterRun(update.gain, update.whitening, innovation, transition, x.push, offsets)
            return (corrected, update.covariance), done

        measured = (segment.values, segment.offsets, segment.spreads)
        first = (DisturbedMotion(start, jnp.zeros(6)), _first_covariance(disturbance))
        return jax.lax.scan(advance, first, (inputs, measured, weight))[1]

    return jax.lax.map(lambda row: of_segment(*row), (segments, weights), batch_size=64)


def _first_covariance(disturbance: Disturbance) -> Float[Array, "18 18"]:
    """At the begin of a segment."""
    return jnp.diag(jnp.concatenate([jnp.asarray(START_DEVIATION), disturbance.deviations]) ** 2)


class _Update(NamedTuple):
    measured: Float[Array, "13 18"]  # from a change of the state at the begin of the step to that of the residuals
    gain: Float[Array, "18 13"]
    whitening: Float[Array, "13 13"]
    covariance: Float[Array, "18 18"]
    log_determinant: Float[Array, ""]  # of the covariance of the innovation


def _updated(transition, covariance, weight, offsets, disturbance: Disturbance, kept) -> _Update:
    """Prediction of the covariance over a step with the samples in it, in one; Simon (2006), section 5.3.

    A sample is taken between the begin of the step and its end. The change of the motion is straight in between, and
    what is new of the push in this step moves the vehicle in the next one only.
    """
    is_there = weight > 0
    between_both = (1 - offsets)[:, None] * jnp.asarray(_MEASURED) + offsets[:, None] * (_MEASURED @ transition)
    measured = jnp.where(is_there[:, None], between_both, 0.0)
    variance = jnp.where(is_there, 1 / jnp.where(is_there, weight, 1.0), 1.0)
    root = jnp.linalg.cholesky(measured @ covariance @ measured.T + jnp.diag(variance))
    inverse = jax.scipy.linalg.solve_triangular(root, jnp.eye(13), lower=True)
    gain = transition @ covariance @ measured.T @ inverse.T @ inverse
    left = transition - gain @ measured
    grown = jnp.concatenate([jnp.zeros(12), (1 - kept**2) * disturbance.deviations**2])
    updated = left @ covariance @ left.T + (gain * variance[None, :]) @ gain.T + jnp.diag(grown)
    whitening = jnp.where(is_there[:, None] & is_there[None, :], inverse, 0.0)
    return _Update(measured, gain, whitening, updated, 2 * jnp.log(jnp.diagonal(root)).sum())


@jax.jit
def unlikelihood(disturbance: Disturbance, weights, run: FilterRun, run_kept, step) -> Float[Array, ""]:
    """Minus the logarithm of the likelihood of the measurements for other noise, but for a constant.

    The motion is linear around that of a filter that has run, so that it need not be integrated again.

    Args:
        disturbance: see there.
        weights: of the samples, 1/variance, 0 without one, (S, length, 13).
        run: of the filter.
        run_kept: share of a push that was left after a step in that run.
        step: s.
    """
    kept = disturbance.kept(step)

    def of_segment(weight, run: FilterRun):
        def advance(state, row):
            change, covariance = state  # against the filter that has run
            weight, run = row
            transition = run.transitions.at[12:, 12:].set(kept * jnp.eye(6))
            update = _updated(transition, covariance, weight, run.offsets, disturbance, kept)
            innovation = run.innovations + update.measured @ change
            white = update.whitening @ innovation
            pushed = jnp.concatenate([jnp.zeros(12), (kept - run_kept) * run.pushes])
            change = transition @ change + pushed - update.gain @ innovation + run.gains @ run.innovations
            return (change, update.covariance), 0.5 * ((white**2).sum() + update.log_determinant)

        first = (jnp.zeros(18), _first_covariance(disturbance))
        return jax.lax.scan(advance, first, (weight, run))[1].sum()

    return jax.vmap(of_segment)(weights, run).sum()
