"""Vehicles of the arena, with their thrusters and the size of motions, seas and loads that suit each."""

import math
from typing import Any, NamedTuple


class ArenaVehicle(NamedTuple):
    """A vehicle as it enters all tasks.

    Attributes:
        thruster: part `thruster` of its plant; the nominal model has the same.
        low: options of the thruster at low supply, which the nominal model does not know.
        thrusters: number of them.
        two_lost: numbers of the thrusters that are left where two are not fitted.
        pitches: whether the thrusters turn it upside down, against its own righting moment.
        speed: of its transits, m/s.
        reach: half the length of its motions, m.
        current: of the water, m/s: north, east, down.
        waves: significant height, m.
        payload: mass (kg) and weight in water (N) of what it picks up, and where it holds it, m.
        model: options of the vehicle that the nominal model has in task `wrong_model`: another published set.
        position: tolerance of the position error, rms per axis, m.
        orientation: tolerance of the angle between attitude and reference, rms, rad. Large for a vehicle whose pitch
            follows from its motion.
        sets: published parameter sets, each of which the tasks with foreign models simulate under each other one.
    """

    thruster: dict[str, Any]
    low: dict[str, Any]
    thrusters: int
    two_lost: tuple[int, ...]
    pitches: bool
    speed: float
    reach: float
    current: tuple[float, float, float]
    waves: float
    payload: dict[str, Any]
    model: dict[str, Any]
    position: float
    orientation: float = math.radians(5)
    sets: tuple[str, ...] = ()

    @property
    def limit(self) -> float:
        """Largest input of a thruster, V, or N for one that takes a thrust."""
        return float(self.thruster.get("supply") or self.thruster["thrust_forward_max"])


_T200 = {"kind": "t200", "fidelity": "shaft", "supply": 16}  # V

VEHICLES = {
    "bluerov2_heavy": ArenaVehicle(
        thruster=_T200,
        low={"supply": 12},
        thrusters=8,
        two_lost=(1, 2, 3, 4, 5, 8),
        pitches=True,
        speed=0.4,
        reach=1.5,
        current=(0.25, 0.15, 0.0),
        waves=0.4,
        payload={"mass": 3, "weight": 20, "point": [0.15, 0, 0.1]},
        model={"parameters": "wu2018"},
        position=0.05,
        sets=("vonbenzon2022", "wu2018", "px4", "ng2024", "gazebo_box_drag"),
    ),
    "bluerov2": ArenaVehicle(
        thruster=_T200,
        low={"supply": 12},
        thrusters=6,
        two_lost=(1, 2, 3, 4, 5, 6),
        pitches=False,
        speed=0.5,
        reach=1.5,
        current=(0.25, 0.15, 0.0),
        waves=0.4,
        payload={"mass": 1.5, "weight": 10, "point": [0.05, 0, 0.1]},
        model={"parameters": "li2020"},
        position=0.05,
        orientation=math.radians(20),
    ),
    "odin": ArenaVehicle(
        thruster={"kind": "paper_table3", "fidelity": "shaft", "supply": 24},  # V
        low={"supply": 18},
        thrusters=8,
        two_lost=(1, 2, 3, 4, 5, 7),
        pitches=True,
        speed=0.8,
        reach=2.0,
        current=(0.5, 0.3, 0.0),
        waves=0.8,
        payload={"mass": 20, "weight": 100, "point": [0.2, 0, 0.2]},
        model={},
        position=0.05,
    ),
    "rexrov": ArenaVehicle(
        thruster={"kind": "commanded_thrust", "thrust_forward_max": 1500, "thrust_reverse_max": 1500},  # N
        low={"thrust_forward_max": 1000, "thrust_reverse_max": 1000},
        thrusters=8,
        two_lost=(1, 4, 5, 6, 7, 8),
        pitches=False,
        speed=1.0,
        reach=4.0,
        current=(0.4, 0.25, 0.0),
        waves=0.8,
        payload={"mass": 150, "weight": 1000, "point": [0.8, 0, 0.4]},
        model={"parameters": "uuvsim_nominal"},
        position=0.1,
    ),
}
