"""REMUS 100 (WHOI, Hydroid): 1.3 to 1.6 m, 31 kg torpedo with one propeller, rudder and stern planes."""

import numpy as np

from undertow.physics.vehicles.published import Hull, ThrusterLayout, assemble, choose, inertia_about_origin
from undertow.physics.vehicles.vehicle import VehicleModel

_PRESTERO = "Prestero 2001, MSc thesis, MIT and WHOI"
_MSS = "cybergalactic/MSS CRAFT/AUV/models/remus100.m@736a3d1"
_PVS = "cybergalactic/PythonVehicleSimulator src/python_vehicle_simulator/vehicles/remus100.py@c717e07"


def _spheroid(source: str, density: float, scale: float, cross_flow: float) -> Hull:
    """Prolate spheroid of 1.6 m x 0.19 m, neutrally buoyant. Fossen (2021), ch. 8.4.2.

    Args:
        source: of the model.
        density: that gives the mass, kg/m^3; added mass and drag take 1026 kg/m^3.
        scale: factor on length and diameter of the spheroid.
        cross_flow: two-dimensional drag coefficient.
    """
    length, diameter, water = 1.6, 0.19, 1026.0  # m, m, kg/m^3
    a, b = scale * length / 2, scale * diameter / 2
    volume = 4 / 3 * np.pi * a * b**2
    gyration = np.array([2 * b**2, a**2 + b**2, a**2 + b**2]) / 5  # m^2
    mass, r_g = density * volume, np.array([0, 0, 0.02])
    weight = mass * 9.81

    e = np.sqrt(1 - (b / a) ** 2)
    alpha = 2 * (1 - e**2) / e**3 * (np.arctanh(e) - e)
    beta = 1 / e**2 - (1 - e**2) / e**3 * np.arctanh(e)
    along, across = alpha / (2 - alpha), beta / (2 - beta)  # Lamb's k-factors
    turning = e**4 * (beta - alpha) / ((2 - e**2) * (2 * e**2 - (2 - e**2) * (beta - alpha)))
    added_mass = water * volume * np.concatenate([[along, across, across], [0.3, turning, turning] * gyration])

    inertia = mass * np.diag(gyration)
    total = added_mass + np.concatenate([np.full(3, mass), np.diag(inertia_about_origin(inertia, mass, r_g))])
    roll, pitch = np.sqrt(total[3:5] * weight * r_g[2])  # M times natural frequency
    drag = 0.5 * water * diameter * cross_flow * np.array([length, length**4 / 32])  # integrals of 1 and |x|^3
    return Hull(
        source=source,
        mass=mass,
        weight=weight,
        buoyancy=weight,
        r_g=r_g,
        r_b=[0, 0, 0],
        inertia=inertia,
        added_mass=added_mass,
        linear_damping=[*total[:3] / 20, 2 * 0.3 * roll, 2 * 0.8 * pitch, total[5] / 1],
        quadratic_damping=[0.5 * water * 0.42 * np.pi * b**2, drag[0], drag[0], 0, drag[1], drag[1]],
        notes={
            "linear_damping": f"derived: time constants 20, 20, 20 and 1 s, damping ratios 0.3 and 0.8; {source}",
            "quadratic_damping": f"derived: surge 0.42 (Allen et al. 2000), cross flow {cross_flow:.4g}; {source}",
        },
    )


PARAMETERS = {
    "prestero2001": Hull(
        source=f"{_PRESTERO}, from public transcriptions",
        mass=299 / 9.81,
        weight=299.0,
        buoyancy=308.0,
        r_g=[0, 0, 0.0196],
        r_b=[0, 0, 0],
        inertia=[0.177, 3.45, 3.45],
        added_mass=[
            [0.93, 0, 0, 0, 0, 0],
            [0, 35.5, 0, 0, 0, -1.93],
            [0, 0, 35.5, 0, 1.93, 0],
            [0, 0, 0, 0.0704, 0, 0],
            [0, 0, 1.93, 0, 4.88, 0],
            [0, -1.93, 0, 0, 0, 4.88],
        ],
        linear_damping=[0, 0, 0, 0, 0, 0],
        quadratic_damping=[
            [1.62, 0, 0, 0, 0, 0],
            [0, 131, 0, 0, 0, -0.632],
            [0, 0, 131, 0, 0.632, 0],
            [0, 0, 0, 0.13, 0, 0],
            [0, 0, -3.18, 0, 188, 0],
            [0, 3.18, 0, 0, 0, 94],
        ],
        inertia_about_origin=True,
        notes={"mass": f"derived: W / 9.81 m/s^2; {_PRESTERO}"},
    ),
    # Below the drag crisis a smooth cylinder has 1.21, times 0.66 for its aspect ratio of 8.4 (DNV-RP-C205).
    "fossen_mss": _spheroid(_MSS, 1025.0, 1.0096, 1.21 * 0.66),
    "fossen_python": _spheroid(_PVS, 1026.0, 1.0, 1.1977),  # Hoerner's curve at beam = draft
}


def remus100(parameters: str = "prestero2001") -> VehicleModel:
    """REMUS 100 with its propeller only: surge is controlled, the other degrees of freedom are not.

    Not modelled: rudder, stern planes and propeller torque; lift of the hull; terms in u v, u w, u q and u r other than
    the Coriolis forces of M (prestero2001: Y_uv, Y_ur, Z_uw, Z_uq, M_uw, M_uq, N_uv, N_ur and the fins' u^2; both
    Fossen models: the wing-like lift, and that they zero the Munk moment and let linear damping fade with speed).

    Args:
        parameters: prestero2001: the measured vehicle of 1.33 m; weight 299 N (others 300, 305), buoyancy 308 N
            (others 310). Y_v|v| is 1310 in half of the copies; 131 here, since the hull is one of revolution,
            Z_w|w| is 131 and strip theory gives 144. M_q|q| and N_r|r| of 188 and 94 are 20 and 10 times the 9.4
            of other copies and of strip theory, probably tuned to trials. fossen_mss: spheroid of
            31.9 kg, g = 9.81 m/s^2 instead of the local one. fossen_python: spheroid of 31.03 kg. In both, cross
            flow in heave and pitch equals that in sway and yaw, and is valid for motion along one axis at a time.
    """
    hull = choose("parameters", parameters, PARAMETERS)
    stern = -0.5 * (1.33 if parameters == "prestero2001" else 1.6)
    layout = ThrusterLayout("derived: on the axis at the stern", [[stern, 0, 0]], [[1, 0, 0]])
    return assemble("remus100", hull, layout)
