"""LAUV, Light AUV of the University of Porto and OceanScan: 1.1 m, 18 kg torpedo with one propeller and four fins."""

from undertow.physics.vehicles.published import Hull, ThrusterLayout, assemble
from undertow.physics.vehicles.vehicle import VehicleModel

_UUV = "uuvsimulator/lauv_gazebo lauv_description/urdf@3529e02"

_HULL = Hull(
    source=f"{_UUV}/gazebo.xacro, after Estrela da Silva et al. 2007",
    mass=18.0,
    weight=176.58,
    buoyancy=177.0,
    r_g=[0, 0, 0],
    r_b=[0, 0, -0.01],
    inertia=[0.050625, 1.774913, 1.774913],
    added_mass=[1, 16, 16, 0.005, 1.3, 1.3],
    linear_damping=[
        [2.4, 0, 0, 0, 0, 0],
        [0, 23, 0, 0, 0, -11.5],
        [0, 0, 23, 0, 11.5, 0],
        [0, 0, 0, 0.3, 0, 0],
        [0, 0, -3.1, 0, 9.7, 0],
        [0, 3.1, 0, 0, 0, 9.7],
    ],
    quadratic_damping=[
        [2.4, 0, 0, 0, 0, 0],
        [0, 80, 0, 0, 0, -0.3],
        [0, 0, 80, 0, 0.3, 0],
        [0, 0, 0, 0.0006, 0, 0],
        [0, 0, -1.5, 0, 9.1, 0],
        [0, 1.5, 0, 0, 0, 9.1],
    ],
    notes={
        "weight": "derived: m g",
        "buoyancy": f"derived: 0.01755137 m^3 of 1028 kg/m^3; {_UUV}/gazebo.xacro",
        "inertia": f"solid cylinder of 1.08 m and 0.15 m; {_UUV}/base.xacro",
    },
)
_LAYOUT = ThrusterLayout(f"{_UUV}/actuators.xacro", [[-0.53994, 0, 0]], [[1, 0, 0]])


def lauv() -> VehicleModel:
    """LAUV with its propeller only: surge is controlled, the other degrees of freedom are not.

    Not modelled: the four fins (each 0.0064 m^2 at x = -0.4 m, lift coefficient 3, drag coefficient 1.98) and the
    propeller's reaction torque. The damping matrices are full, as printed; UUV Simulator itself uses only the
    diagonal of the quadratic one. Positive thrust pushes forward (the source mounts the propeller backwards).
    """
    return assemble("lauv", _HULL, _LAYOUT)
