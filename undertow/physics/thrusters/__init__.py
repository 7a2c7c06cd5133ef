"""Thrusters: volts in, thrust out. One file per thruster; `fidelity.py` has the levels of a DC motor."""

from undertow.core.catalogue import publish
from undertow.physics.thrusters.motor import DCMotor as DCMotor
from undertow.physics.thrusters.thruster import AbstractThruster as AbstractThruster

__getattr__ = publish(__name__)
