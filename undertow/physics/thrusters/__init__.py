"""Thrusters: volts in, thrust out. One file per thruster.

The fidelity levels of a DC motor are in `motor_thruster.py` (without dynamics) and `fidelity_levels.py`.
"""

from undertow.core.catalogue import publish
from undertow.physics.thrusters.motor import DCMotor as DCMotor
from undertow.physics.thrusters.thruster import AbstractThruster as AbstractThruster

__getattr__ = publish(__name__)
