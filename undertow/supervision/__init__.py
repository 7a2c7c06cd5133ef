"""Supervision: what notices in closed loop that a part has failed, and what goes on without it."""
