"""NPS AUV II (Naval Postgraduate School): box-shaped, 5.3 m, 5.4 t, one propeller and fins; Healey & Lienard 1993."""

import numpy as np

from undertow.core import checks
from undertow.physics.vehicles.published import Hull, ThrusterLayout, assemble, choose
from undertow.physics.vehicles.vehicle import VehicleModel

_HEALEY = "Healey & Lienard 1993, IEEE J. Oceanic Eng. 18(3) 327-339"
_LENGTH = 5.3  # m
_SIDE = 0.53  # m, height and width of a section in the cross-flow integrals
_WEIGHT = 53400.0  # N

# Source, mass in kg and density of the water in kg/m^3.
PARAMETERS = {
    "fossen_mss": (f"{_HEALEY}, via cybergalactic/MSS CRAFT/AUV/models/npsauv.m@736a3d1", _WEIGHT / 9.81, 1025.0),
    "antonelli_simurv": (
        f"{_HEALEY}, via G. Antonelli, SIMURV 4.0, 2013, SIAEthen/simurv_unicas func/InverseDynamics_vehicle.m@ff4d0a1",
        5454.54,
        1000.0,
    ),
}

# Derivatives in the prime system: forces are in units of density/2 L^2 (m/s)^2, moments L times that.
_ADDED_MASS = np.array(
    [
        [7.6e-3, 0, 0, 0, 0, 0],
        [0, 5.5e-2, 0, -1.2e-4, 0, -1.2e-3],
        [0, 0, 2.4e-1, 0, 6.8e-3, 0],
        [0, -1.2e-4, 0, 1.0e-3, 0, 3.4e-5],
        [0, 0, 6.8e-3, 0, 1.7e-2, 0],
        [0, -1.2e-3, 0, 3.4e-5, 0, 3.4e-3],
    ]
)
_Y_V, _Z_W, _K_P, _M_Q, _N_R = -1.0e-1, -3.0e-1, -1.1e-2, -6.8e-2, -1.6e-2  # times u
_Z_QDOT, _Y_RDOT = -6.8e-3, 1.2e-3
_DRAG, _DRAG_SIDEWAYS, _DRAG_VERTICAL = 3.85e-3, 0.5, 0.6  # surge, and two-dimensional cross flow


def npsauv2(parameters: str = "fossen_mss", speed: float = 1.63) -> VehicleModel:
    """NPS AUV II with its propeller only: surge is controlled, the other degrees of freedom are not.

    Derived from the published derivatives: linear damping in sway, heave, roll, pitch and yaw is that of Y_v u v,
    Z_w u w, K_p u p, M_q u q and N_r u r at the given speed, less the part of the last two that the Coriolis forces
    of the added mass contain; quadratic damping is the propeller-off drag in surge, and the cross-flow integral
    over the hull in closed form for pure sway, heave, pitch and yaw. Not modelled: fins and their drag, the propeller's
    effect on hull and fins, and all other derivatives (Y_p, Y_r, Z_q, K_v, K_r, M_w, N_v, N_p, and products of two of
    v, w, p, q, r), of which the Coriolis forces keep the ideal-fluid part.

    Doubtful: the cross-flow section of 0.53 m x 0.53 m holds 28 % of the displaced volume.

    Args:
        parameters: fossen_mss: mass 5443 kg, density 1025 kg/m^3. antonelli_simurv: 5454.54 kg and 1000 kg/m^3.
        speed: cruising speed for which the linear damping holds, m/s; the default is 0.012 times the propeller
            speed, in rad/s, of MSS's example (1300 rpm).

    Raises:
        BadInput: unknown parameters, or speed negative.
    """
    source, mass, density = choose("parameters", parameters, PARAMETERS)
    checks.not_negative("speed", speed, "m/s")
    units = np.array([1, 1, 1, _LENGTH, _LENGTH, _LENGTH])
    force = 0.5 * density * _LENGTH**2
    against_turning = _LENGTH**3 / 32  # integral of |x|^3 over the hull, per length
    damping = [0, -_Y_V, -_Z_W, -_K_P, -(_M_Q + _Z_QDOT), -(_N_R - _Y_RDOT)]
    sideways, vertical = 0.5 * density * _SIDE * _LENGTH * np.array([_DRAG_SIDEWAYS, _DRAG_VERTICAL])
    hull = Hull(
        source=source,
        mass=mass,
        weight=_WEIGHT,
        buoyancy=_WEIGHT,
        r_g=[0, 0, 0.061],
        r_b=[0, 0, 0],
        inertia=[[2038.0, 13.58, 13.58], [13.58, 13587.0, 13.58], [13.58, 13.58, 13587.0]],
        added_mass=force * _LENGTH * np.outer(units, units) * _ADDED_MASS,
        linear_damping=force * speed * units**2 * damping,
        quadratic_damping=[
            force * _DRAG,
            sideways,
            vertical,
            0,
            vertical * against_turning,
            sideways * against_turning,
        ],
        inertia_about_origin=True,
        notes={
            "linear_damping": f"derived: linearised at {speed:g} m/s; {source}",
            "quadratic_damping": f"derived: closed form of the cross-flow integrals; {source}",
        },
    )
    return assemble(
        "npsauv2", hull, ThrusterLayout("derived: on the axis at the stern", [[-_LENGTH / 2, 0, 0]], [[1, 0, 0]])
    )
