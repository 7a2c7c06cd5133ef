"""Supervision of a controller: gates for what goes in and out, states with reasons, and failed thrusters."""
