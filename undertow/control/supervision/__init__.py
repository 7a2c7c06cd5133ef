"""Supervision of a controller: gates for what goes in and out, states with reasons, and failed thrusters."""

from undertow.core.catalogue import publish

__getattr__ = publish(__name__)
