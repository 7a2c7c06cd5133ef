"""A body that differs from the nominal model: scaled coefficients, or attached payloads."""

import functools

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.contracts import ModelScaling, Payload
from undertow.core.numerics.linear_algebra import inverse_symmetric
from undertow.physics.vehicles.body import Body, rigid_body_mass


def altered(body: Body, scaling: ModelScaling | None, payloads: tuple[Payload, ...]) -> Body:
    """The body with its coefficients scaled, and then with payloads attached; None and () leave it unchanged."""
    if scaling is not None:
        body = _scaled(body, scaling)
    return functools.reduce(_carrying, payloads, body)


def point_inertia(mass: Float[Array, ""], point: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Inertia (kg m^2) about the origin of a point mass (kg) at a point (m)."""
    return mass * ((point @ point) * jnp.eye(3) - jnp.outer(point, point))


def _scaled(body: Body, scaling: ModelScaling) -> Body:
    return eqx.tree_at(
        lambda b: (
            b.mass_matrix,
            b.inverse_mass_matrix,
            b.linear_damping,
            b.quadratic_damping,
            b.weight,
            b.buoyancy,
            b.gravity,
        ),
        body,
        (
            scaling.mass * body.mass_matrix,
            body.inverse_mass_matrix / scaling.mass,
            scaling.damping * body.linear_damping,
            scaling.damping * body.quadratic_damping,
            scaling.restoring * body.weight,
            scaling.restoring * body.buoyancy,
            scaling.restoring * body.gravity,  # mass = weight / gravity stays
        ),
    )


def _carrying(body: Body, payload: Payload) -> Body:
    mass_matrix = body.mass_matrix + rigid_body_mass(
        payload.mass, payload.point, point_inertia(payload.mass, payload.point)
    )
    in_air = payload.mass * body.gravity
    lift = in_air - payload.weight
    weight, buoyancy = body.weight + in_air, body.buoyancy + lift
    return eqx.tree_at(
        lambda b: (b.mass_matrix, b.inverse_mass_matrix, b.weight, b.buoyancy, b.r_g, b.r_b),
        body,
        (
            mass_matrix,
            inverse_symmetric(mass_matrix),
            weight,
            buoyancy,
            (body.weight * body.r_g + in_air * payload.point) / weight,
            (body.buoyancy * body.r_b + lift * payload.point) / buoyancy,
        ),
    )
