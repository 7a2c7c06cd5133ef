"""BlueROV2 Heavy (Blue Robotics): small inspection vehicle with eight T200 thrusters, four of them vertical."""

import numpy as np

from undertow.physics.vehicles.published import Hull, ThrusterLayout, assemble, choose
from undertow.physics.vehicles.vehicle import VehicleModel

_WU = "Wu 2018, MSc thesis, Flinders University, via OsloMet-OceanLab/BlueROV2 BlueRov_m_script.m@a536a75"
_NG = "dorsa-rh/bluerov2heavy bluerov2heavy_mpc/scripts/bluerov2heavy.py@0bb69f9"
_IGNITION = "clydemcqueen/bluerov2_ignition models/bluerov2_heavy/configs.yaml@9ec0350"
_PX4 = "PX4/PX4-gazebo-models models/uuv_bluerov2_heavy/model.sdf@5577035"

PARAMETERS = {
    "vonbenzon2022": Hull(
        source="von Benzon et al. 2022, J. Mar. Sci. Eng. 10(12) 1898, Table A1",
        mass=13.5,
        weight=132.57,
        buoyancy=131.588,
        r_g=[0, 0, 0],
        r_b=[0, 0, -0.01],
        inertia=[0.26, 0.23, 0.37],
        added_mass=[6.36, 7.12, 18.68, 0.189, 0.135, 0.222],
        linear_damping=[13.7, 0, 33, 0, 0.8, 0],
        quadratic_damping=[141, 217, 190, 1.19, 0.47, 1.5],
        notes={
            "weight": "derived: m g with g = 9.82 m/s^2",
            "buoyancy": "derived: 0.0134 m^3 (Table A1) of fresh water, 1000 kg/m^3, g = 9.82 m/s^2",
        },
    ),
    "wu2018": Hull(
        source=_WU,
        mass=11.5,
        weight=112.8,
        buoyancy=114.8,
        r_g=[0, 0, 0.02],
        r_b=[0, 0, 0],
        inertia=[0.16, 0.16, 0.16],
        added_mass=[5.5, 12.7, 14.57, 0.12, 0.12, 0.12],
        linear_damping=[4.03, 6.22, 5.18, 0.07, 0.07, 0.07],
        quadratic_damping=[18.18, 21.66, 36.99, 1.55, 1.55, 1.55],
    ),
    "ng2024": Hull(
        source=f"Ng 2024, tank identification, via {_NG}",
        mass=11.5,
        weight=112.815,
        buoyancy=119.49,
        r_g=[0, 0, 0.02],
        r_b=[0, 0, 0],
        inertia=[0.8571, 1, 1],
        added_mass=[10.77, 24.86, 34.60, 0.103, 0.120, 0.120],
        linear_damping=[38.95, 60.11, 49.50, 0, 0, 0],
        quadratic_damping=[31.01, 36.95, 113.86, 2.08, 2.42, 2.42],
        notes={"weight": "derived: m g", "buoyancy": "derived: weight and the printed net buoyancy of 6.675 N"},
    ),
    "gazebo_box_drag": Hull(
        source=_IGNITION,
        mass=13.0,
        weight=127.53,
        buoyancy=128.51,
        r_g=[0, 0, -0.011],
        r_b=[0, 0, -0.06],
        inertia=[0.26, 0.23, 0.37],
        added_mass=[0, 0, 0, 0, 0, 0],
        linear_damping=[0, 0, 0, 0, 0, 0],
        quadratic_damping=[58.42, 55.137, 124.818, 4, 4, 4],
        notes={"weight": "derived: m g", "buoyancy": "derived: displaces 0.1 kg more than its mass"},
    ),
    "px4": Hull(
        source=_PX4,
        mass=13.4,
        weight=13.4 * 9.8,
        buoyancy=13.5 * 9.8,
        r_g=[0, 0, 0.012 / 13.4],
        r_b=[0, 0, -0.02],
        inertia=[0.2624, 0.22852, 0.37448],
        added_mass=[1.272, 1.424, 3.736, 0.0378, 0.027, 0.0444],
        linear_damping=[13.7, 1, 23, 0.5, 0.8, 0.1],
        quadratic_damping=[14.1, 21.7, 19, 0.119, 0.047, 0.15],
        inertia_about_origin=True,
        notes={
            "mass": f"derived: 13 kg and eight propellers of 0.05 kg; {_PX4}",
            "weight": "derived: m g with the world's g = 9.8 m/s^2",
            "buoyancy": "derived: collision box of 0.0135 m^3 in the world's 1000 kg/m^3",
            "r_g": "derived: body at the origin, propellers where they are",
            "inertia": f"derived: (0.25, 0.221, 0.356) and the propellers as points; {_PX4}",
        },
    ),
}

_CORNERS = np.array([[1, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]], dtype=float)
_POSITIONS = np.concatenate([_CORNERS * [0.156, 0.111, 0.085], _CORNERS * [0.120, 0.218, 0]])
_INWARD = np.sqrt(0.5) * np.array([[1, -1, 0], [1, 1, 0], [-1, -1, 0], [-1, 1, 0]], dtype=float)


def _vertical(*down: int) -> np.ndarray:
    return np.array([[0, 0, z] for z in down], dtype=float)


LAYOUTS = {
    "vonbenzon2022": ThrusterLayout(
        "von Benzon et al. 2022, mirror images, via ViktorNfa/bluerov2_dynamics fossen/BlueROV2.py@aafc093",
        _POSITIONS,
        np.concatenate([_INWARD, _vertical(-1, -1, -1, -1)]),
    ),
    "wu2018": ThrusterLayout(_WU, _POSITIONS, np.concatenate([_INWARD, _vertical(-1, 1, 1, -1)])),
    "ardusub_gazebo": ThrusterLayout(
        f"positions: {_IGNITION}; signs: ArduPilot AP_Motors6DOF.cpp, SUB_FRAME_VECTORED_6DOF",
        [[0.140, 0.092, 0], [0.140, -0.092, 0], [-0.150, 0.092, 0], [-0.150, -0.092, 0]]
        + [[0.118, 0.215, -0.064], [0.118, -0.215, -0.064], [-0.118, 0.215, -0.064], [-0.118, -0.215, -0.064]],
        np.concatenate([-_INWARD, _vertical(1, 1, 1, 1)]),
    ),
}


def bluerov2_heavy(parameters: str = "vonbenzon2022", layout: str = "vonbenzon2022") -> VehicleModel:
    """BlueROV2 Heavy with one of its published parameter sets.

    The sets are different vehicles and fits, not repeated measurements: surge drag at 0.5 m/s is 6.6 (wu2018), 10.4
    (px4), 14.6 (gazebo_box_drag), 27.2 (ng2024) or 42.1 N (vonbenzon2022). Together they are a band of uncertainty;
    numbers of two sets should not be mixed.

    Left out: the set identified by edxmorgan/diff_uv (mass and added mass lumped, nothing about rotation), that of
    IOES DAVE (no added mass or linear damping, rest not given), and layouts printed with wrong signs or lever arms.

    Args:
        parameters: hull. vonbenzon2022: validated in a tank; no linear damping in sway, roll and yaw. wu2018: the most
            copied, drag 5 to 10 times lower. ng2024: identified in a tank, heave when diving (when rising: added mass
            22.45 kg, damping 50.62 and 76.69); its inertia is large for its size. gazebo_box_drag: no added mass, drag
            of the bounding box. px4: the Gazebo model of PX4, von Benzon's numbers with added mass x 0.2 and quadratic
            damping x 0.1.
        layout: thrusters, 1-4 horizontal at 45 degrees, 5-8 vertical. vonbenzon2022: 5-8 push up. wu2018: the same
            positions, 6 and 7 push down. ardusub_gazebo: order and signs of ArduSub, positions relative to the
            base_link of the Gazebo model, 11 mm below its centre of gravity.
    """
    hull = choose("parameters", parameters, PARAMETERS)
    return assemble("bluerov2_heavy", hull, choose("layout", layout, LAYOUTS))
