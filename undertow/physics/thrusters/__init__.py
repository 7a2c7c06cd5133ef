"""Thrusters: volts in, thrust out. One file per thruster; `motor_dynamics.py` and `motor_thruster.py` have the fidelity levels of a DC motor."""

from undertow.core.catalogue import publish
from undertow.physics.thrusters.motor import DCMotor as DCMotor
from undertow.physics.thrusters.thruster import AbstractThruster as AbstractThruster

__getattr__ = publish(__name__)
