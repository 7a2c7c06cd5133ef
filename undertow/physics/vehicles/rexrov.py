"""RexROV: the work-class vehicle of UUV Simulator, after the Sperre SubFighter 30k; 1.9 t, eight thrusters."""

import numpy as np

from undertow.physics.vehicles.published import Hull, ThrusterLayout, assemble, choose
from undertow.physics.vehicles.vehicle import VehicleModel

_UUV = "uuvsimulator/uuv_simulator@bfb40cb"
_BODY = {
    "mass": 1862.87,
    "weight": 18274.75,
    "buoyancy": 18538.33,
    "r_g": [0, 0, 0],
    "r_b": [0, 0, -0.3],
    "inertia": [[525.39, -1.44, -33.41], [-1.44, 794.20, 2.6], [-33.41, 2.6, 691.23]],
    "notes": {
        "weight": "derived: m g",
        "buoyancy": "derived: 1.83826 m^3 (Berg 2012) of 1028 kg/m^3",
        "r_b": f"{_UUV} uuv_descriptions/urdf/rexrov.gazebo.xacro; Berg's (0.0822, -0.0077, 0.3872) has unclear axes",
    },
}
_ADDED_MASS = np.array(
    [
        [779.79, -6.8773, -103.32, 8.5426, -165.54, -7.8033],
        [-6.8773, 1222.0, 51.29, 409.44, -5.8488, 62.726],
        [-103.32, 51.29, 3659.9, 6.1112, -386.42, 10.774],
        [8.5426, 409.44, 6.1112, 534.9, -10.027, 21.019],
        [-165.54, -5.8488, -386.42, -10.027, 842.69, -1.1162],
        [-7.8033, 62.726, 10.775, 21.019, -1.1162, 224.32],
    ]
)

PARAMETERS = {
    "berg2012": Hull(
        source=f"Berg 2012, MSc thesis, NTNU, pp. 28-31, via {_UUV} uuv_descriptions/urdf/rexrov.gazebo.xacro",
        added_mass=0.5 * (_ADDED_MASS + _ADDED_MASS.T),  # printed with 10.774 opposite 10.775
        linear_damping=[74.82, 69.48, 728.4, 268.8, 309.77, 105.0],
        quadratic_damping=[748.22, 992.53, 1821.01, 672.0, 774.44, 523.27],
        **_BODY,
    ),
    "uuvsim_nominal": Hull(
        source=f"{_UUV} uuv_control/uuv_trajectory_control/config/models/rexrov/params.yaml",
        added_mass=[700, 1200, 3500, 500, 800, 200],
        linear_damping=[70, 70, 700, 200, 300, 100],
        quadratic_damping=[700, 900, 1800, 600, 700, 500],
        **_BODY,
    ),
}

# Poses as in the source: x forward, y port, z up; the thruster pushes along its own x axis, pitched and yawed.
_DEGREE = 0.01745329  # rad; the source's own, with which its thruster matrix was computed
_PITCH = _DEGREE * np.array([-74.53, -74.53, -105.47, -105.47, 0, 0, 0, 0])
_YAW = _DEGREE * np.array([-53.21, 53.21, 53.21, -53.21, 45, -45, 135, -135])
_TO_STARBOARD_DOWN = np.array([1.0, -1.0, -1.0])
_POSITIONS = np.array(
    [[-0.890895, 0.334385, 0.528822], [-0.890895, -0.334385, 0.528822]]
    + [[0.890895, 0.334385, 0.528822], [0.890895, -0.334385, 0.528822]]
    + [[-0.412125, 0.505415, 0.129], [-0.412125, -0.505415, 0.129]]
    + [[0.412125, 0.505415, 0.129], [0.412125, -0.505415, 0.129]]
)
_AXES = np.column_stack([np.cos(_PITCH) * np.cos(_YAW), np.cos(_PITCH) * np.sin(_YAW), -np.sin(_PITCH)])

_LAYOUT = ThrusterLayout(
    f"{_UUV} uuv_descriptions/urdf/rexrov_actuators.xacro", _POSITIONS * _TO_STARBOARD_DOWN, _AXES * _TO_STARBOARD_DOWN
)


def rexrov(parameters: str = "berg2012") -> VehicleModel:
    """RexROV: thrusters 1-4 mostly vertical (positive thrust pushes up), 5-8 horizontal at 45 degrees.

    Poses are those of the URDF, turned from forward, port, up. The added mass is unchanged, because UUV Simulator
    applies it in forward, starboard, down.

    Args:
        parameters: berg2012: added mass full, made symmetric. uuvsim_nominal: that of the model-based controllers
            of UUV Simulator, rounded and diagonal; the body is the same. Suitable as a nominal model.
    """
    return assemble("rexrov", choose("parameters", parameters, PARAMETERS), _LAYOUT)
