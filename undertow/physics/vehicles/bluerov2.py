"""BlueROV2 (Blue Robotics) as sold: six T200 thrusters, two of them vertical on the centre line, so rank 5."""

import numpy as np

from undertow.physics.vehicles.published import Hull, ThrusterLayout, assemble, choose
from undertow.physics.vehicles.vehicle import VehicleModel

_HKPOLYU = "HKPolyU-UAV/bluerov2@371f35d"
_KTH = "ViktorNfa/bluerov2_dynamics fossen/parameters.py@aafc093"
_NANTES = "CentraleNantesROV/bluerov2 bluerov2_description/urdf@bce97d6"
_HYDRO = "CentraleNantesROV/bluerov2 bluerov2_description/specs/hydro.py@bce97d6"
_GZ = "clydemcqueen/bluerov2_gz models/bluerov2/model.sdf@e21e884"
_WU_TOO = f"as Wu 2018 (Heavy), so copied in {_HYDRO}"

PARAMETERS = {
    "hkpolyu": Hull(
        source=f"{_HKPOLYU} bluerov2_dobmpc/include/bluerov2_dobmpc/bluerov2_dob.h",
        mass=11.26,
        weight=110.461,
        buoyancy=111.122,
        r_g=[0, 0, 0.02],
        r_b=[0, 0, 0],
        inertia=[0.3, 0.63, 0.58],
        added_mass=[1.7182, 0, 5.468, 0, 1.2481, 0.4006],
        linear_damping=[11.7391, 20, 31.8678, 25, 44.9085, 5],
        quadratic_damping=[18.18, 21.66, 36.99, 1.55, 1.55, 1.55],
        notes={"weight": "derived: m g", "buoyancy": "derived: weight and the printed net buoyancy of 0.661618 N"},
    ),
    "einarsson_lipenitis2020": Hull(
        source=f"Einarsson & Lipenitis 2020, MSc thesis, Aalborg University, via {_KTH}",
        mass=11.4,
        weight=111.948,
        buoyancy=115.866,
        r_g=[0, 0, 0],
        r_b=[0, 0, -0.1],
        inertia=[0.21, 0.245, 0.245],
        added_mass=[2.6, 18.5, 13.3, 0.054, 0.0173, 0.28],
        linear_damping=[0.09, 0.26, 0.19, 0.895, 0.287, 4.64],
        quadratic_damping=[34.96, 103.25, 74.23, 0.084, 0.028, 0.43],
        notes={
            "weight": "derived: m g with g = 9.82 m/s^2",
            "buoyancy": "derived: 0.0115 m^3 of 1026 kg/m^3, g = 9.82 m/s^2",
            "r_b": f"{_KTH}; -0.01 m is likely meant",
        },
    ),
    "li2020": Hull(
        source=f"Li et al. 2020, J. Mar. Sci. Eng., via {_HYDRO}",
        mass=11.5,
        weight=112.8,
        buoyancy=114.8,
        r_g=[0, 0, 0.02],
        r_b=[0, 0, 0],
        inertia=[0.16, 0.16, 0.16],
        added_mass=[5.5, 12.7, 14.57, 0.12, 0.12, 0.12],
        linear_damping=[1.31, 9.14, 2.015, 0.07, 0.07, 0],
        quadratic_damping=[38.17, 129.6, 243.2, 1.55, 1.55, 4.86],
        notes={name: _WU_TOO for name in ("mass", "weight", "buoyancy", "r_g", "r_b", "inertia", "added_mass")},
    ),
    "gazebo_box_drag": Hull(
        source=_GZ,
        mass=10.0,
        weight=98.0,
        buoyancy=98.49,
        r_g=[0, 0, -0.011],
        r_b=[0, 0, -0.06],
        inertia=[0.099, 0.178, 0.269],
        added_mass=[0, 0, 0, 0, 0, 0],
        linear_damping=[0, 0, 0, 0, 0, 0],
        quadratic_damping=[33.732, 54.16, 73.225, 3.992, 3.992, 3.992],
        notes={
            "weight": "derived: m g with g = 9.8 m/s^2",
            "buoyancy": "derived: displaces 0.05 kg more than its mass, models/bluerov2/configs.yaml",
        },
    ),
    "centrale_nantes": Hull(
        source=_NANTES,
        mass=15.22,
        weight=149.156,
        buoyancy=153.676,
        r_g=[0, 0, 0.11435],
        r_b=[0, 0, 0.02904],
        inertia=[[5.2539, -0.0144, -0.3341], [-0.0144, 7.9420, 0.026], [-0.3341, 0.026, 6.9123]],
        added_mass=[5.5, 12.7, 14.57, 0.12, 0.12, 0.12],
        linear_damping=[25.15, 7.364, 17.955, 10.888, 20.761, 3.744],
        quadratic_damping=[33.8, 54.26875, 73.37135, 40, 40, 40],
        notes={
            "mass": f"derived: 14.8 kg and six propellers of 0.07 kg; {_NANTES}/bluerov2.xacro",
            "weight": "derived: m g with g = 9.8 m/s^2",
            "buoyancy": "derived: collision box, 1.01^3 times the mass in fresh water",
            "r_g": f"derived: body and propellers; {_NANTES}/bluerov2.xacro",
            "r_b": f"derived: centre of the collision box; {_NANTES}/bluerov2.xacro",
            "added_mass": _WU_TOO,
        },
    ),
}

_INWARD = np.sqrt(0.5) * np.array([[1, -1, 0], [1, 1, 0], [-1, -1, 0], [-1, 1, 0]], dtype=float)
_UP = np.array([[0, 0, -1], [0, 0, -1]], dtype=float)

LAYOUTS = {
    "hkpolyu": ThrusterLayout(
        f"{_HKPOLYU} bluerov2_environ/urdf/actuators.xacro and bluerov2_dobmpc/config/TAM.yaml",
        [[0.1355, 0.1, 0.0725], [0.1355, -0.1, 0.0725], [-0.1475, 0.1, 0.0725], [-0.1475, -0.1, 0.0725]]
        + [[0.0025, 0.1105, 0.005], [0.0025, -0.1105, 0.005]],
        np.concatenate([_INWARD, _UP]),
    ),
    "ignition": ThrusterLayout(
        "clydemcqueen/bluerov2_ignition models/bluerov2/configs.yaml@9ec0350; signs of 1-4: ArduSub, of 5-6: ours",
        [[0.140, 0.092, 0], [0.140, -0.092, 0], [-0.150, 0.092, 0], [-0.150, -0.092, 0]]
        + [[0, 0.109, -0.077], [0, -0.109, -0.077]],
        np.concatenate([-_INWARD, _UP]),
    ),
}


def bluerov2(parameters: str = "hkpolyu", layout: str = "hkpolyu") -> VehicleModel:
    """BlueROV2 with six thrusters: five degrees of freedom are independent, pitch follows surge and heave.

    Args:
        parameters: hull. hkpolyu: added mass and linear damping are those of another vehicle (Desistek SAGA), with
            none in sway and roll. einarsson_lipenitis2020: named after its inertia; another copy
            (CentraleNantesROV) has other damping, and the centre of buoyancy is likely ten times too high. li2020:
            damping only, the rest is Wu's Heavy. gazebo_box_drag: no added mass, drag of the bounding box.
            centrale_nantes: inertia of RexROV / 100, twenty times too large; floats up with 3 % of its weight.
        layout: thrusters, 1-4 horizontal at 45 degrees, 5-6 vertical and pushing up. hkpolyu: 1-4 lie 7 cm below the
            origin. ignition: order and signs of ArduSub, but for 5-6, which push down there; positions relative to
            the base_link of the Gazebo model, 11 mm below its centre of gravity.
    """
    hull = choose("parameters", parameters, PARAMETERS)
    return assemble("bluerov2", hull, choose("layout", layout, LAYOUTS))
