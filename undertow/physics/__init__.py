"""What the world does: vehicles, thrusters, power, water, sensors, and what goes wrong with them."""
