"""What is estimated: the free parameters of the vehicle, and for each dive a current and biases."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.studies.identification.free_parameters import FreeParameter
from undertow.studies.identification.identified_vehicle import IdentifiedVehicle, PriorVehicle
from undertow.studies.identification.prediction import Sensing, residuals
from undertow.studies.identification.segments import START_DEVIATION

# Of each dive, beforehand: current north and east, m/s; biases of the angular velocity, rad/s.
NUISANCES = ("current.north", "current.east", "rate_bias.p", "rate_bias.q", "rate_bias.r")
NUISANCE_UNITS = ("m/s", "m/s", "rad/s", "rad/s", "rad/s")
_NUISANCE_DEVIATIONS = (0.2, 0.2, 0.02, 0.02, 0.02)


_AT_ONCE = 64  # segments that are computed side by side


class Unknowns(NamedTuple):
    """Layout of the vector of unknown numbers: parameters of the vehicle, then nuisances of each dive."""

    parameters: tuple[FreeParameter, ...]
    dives: int

    def all(self) -> list[FreeParameter]:
        """Parameters and nuisances."""
        nuisances = [
            FreeParameter(f"{name} of dive {dive + 1}", unit, 0.0, deviation)
            for dive in range(self.dives)
            for name, unit, deviation in zip(NUISANCES, NUISANCE_UNITS, _NUISANCE_DEVIATIONS, strict=True)
        ]
        return [*self.parameters, *nuisances]

    def least(self) -> np.ndarray:
        """Smallest number of each."""
        return np.array([parameter.least_z for parameter in self.all()])


class CandidateVehicle(NamedTuple):
    """A vehicle and what lies between it and the log of each dive."""

    vehicle: IdentifiedVehicle
    command_delay: Float[Array, ""]
    nuisances: Float[Array, "dives 5"]

    def sensing(self, dive) -> Sensing:
        """Of one dive."""
        of_dive = self.nuisances[dive]
        current = jnp.concatenate([of_dive[:2], jnp.zeros(1)])
        return Sensing(self.command_delay, current, of_dive[2:])


class IdentificationModel(eqx.Module):
    """Maps unknown numbers to residuals."""

    prior: PriorVehicle
    means: Float[Array, " P"]
    deviations: Float[Array, " P"]
    names: tuple[str, ...] = eqx.field(static=True)
    is_ratio: tuple[bool, ...] = eqx.field(static=True)
    nuisance_deviations: Float[Array, "5"]

    def candidate(self, z: Float[Array, " unknowns"]) -> CandidateVehicle:
        """What a vector of unknown numbers stands for."""
        count = len(self.names)
        scaled = self.deviations * z[:count]
        values = {
            name: self.means[i] * jnp.exp(scaled[i]) if ratio else self.means[i] + scaled[i]
            for i, (name, ratio) in enumerate(zip(self.names, self.is_ratio, strict=True))
        }
        delay = values.get("command_delay", values.get("axis_delay", jnp.zeros(())))
        nuisances = self.nuisance_deviations[None, :] * z[count:].reshape(-1, len(NUISANCES))
        return CandidateVehicle(self.prior.with_values(values), delay, nuisances)

    def residuals(self, z: Float[Array, " unknowns"], start: Float[Array, "12"], segment: Any, step: Float[Array, ""]):
        """Residuals of a segment; `start` in standard deviations of the guess."""
        candidate = self.candidate(z)
        change = jnp.asarray(START_DEVIATION) * start
        return residuals(candidate.vehicle, candidate.sensing(segment.dive), change, segment, step)


def model_of(prior: PriorVehicle, parameters: Sequence[FreeParameter]) -> IdentificationModel:
    """The model of a vehicle with free parameters."""
    return IdentificationModel(
        prior=prior,
        means=jnp.asarray([parameter.prior for parameter in parameters], dtype=float),
        deviations=jnp.asarray([parameter.deviation for parameter in parameters], dtype=float),
        names=tuple(parameter.name for parameter in parameters),
        is_ratio=tuple(parameter.is_ratio for parameter in parameters),
        nuisance_deviations=jnp.asarray(_NUISANCE_DEVIATIONS),
    )


class NormalEquations(NamedTuple):
    """Of a segment, from weighted residuals r and their derivatives A (unknowns) and B (motion at the begin)."""

    aa: Any  # A' A, (P, P)
    ab: Any  # A' B, (P, 12)
    bb: Any  # B' B, (12, 12)
    a: Any  # A' r, (P,)
    b: Any  # B' r, (12,)


@eqx.filter_jit
def normal_equations(model: IdentificationModel, z, starts, segments, weights, step) -> NormalEquations:
    """Of each segment.

    Args:
        model: see there.
        z: unknowns.
        starts: of each segment, (S, 12).
        segments: `Segments`.
        weights: of each residual, (S, length, 13): 1/variance, 0 without a sample.
        step: s.
    """

    def of_segment(start, segment, weight):
        r, derivative = _linearized(model, z, start, segment, step)
        flat = jnp.where(weight > 0, r, 0.0).reshape(-1)
        weighted = weight.reshape(-1)
        a, b = derivative[:, : z.shape[0]], derivative[:, z.shape[0] :]
        wa = weighted[:, None] * a
        wb = weighted[:, None] * b
        return NormalEquations(wa.T @ a, wa.T @ b, wb.T @ b, wa.T @ flat, wb.T @ flat)

    return jax.lax.map(lambda row: of_segment(*row), (starts, segments, weights), batch_size=_AT_ONCE)


@eqx.filter_jit
def scores(model: IdentificationModel, z, starts, segments, weights, residuals, reduction, step):
    """Gradient of each step, with what the free begin of the segment takes up removed: (S, length, P).

    Args:
        model, z, starts, segments, weights, step: as above.
        residuals: (S, length, 13).
        reduction: bb^-1 ab' of each segment, (S, 12, P).
    """

    def of_segment(start, segment, weight, r, reduced):
        _, derivative = _linearized(model, z, start, segment, step)
        weighted = weight * jnp.where(weight > 0, r, 0.0)
        a, b = derivative[:, : z.shape[0]], derivative[:, z.shape[0] :]
        projected = (a - b @ reduced).reshape(*r.shape, -1)
        return jnp.einsum("kc,kcp->kp", weighted, projected)

    rows = (starts, segments, weights, residuals, reduction)
    return jax.lax.map(lambda row: of_segment(*row), rows, batch_size=_AT_ONCE)


@eqx.filter_jit
def all_residuals(model: IdentificationModel, z, starts, segments, step):
    """Residuals of all segments, (S, length, 13)."""
    of_segment = lambda start, segment: model.residuals(z, start, segment, step)
    return jax.vmap(of_segment)(starts, segments)


def _linearized(model: IdentificationModel, z, start, segment, step):
    """Residuals of a segment, and their derivative by the unknowns and the begin, (residuals, P + 12)."""

    def flat(unknowns):
        return model.residuals(unknowns[: z.shape[0]], unknowns[z.shape[0] :], segment, step)

    unknowns = jnp.concatenate([z, start])
    r, derivative = jax.linearize(flat, unknowns)
    columns = jax.vmap(derivative)(jnp.eye(unknowns.shape[0]))
    return r, columns.reshape(unknowns.shape[0], -1).T
