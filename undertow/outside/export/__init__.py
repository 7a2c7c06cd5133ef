"""The controller and the vehicle outside Python: C99, and units of co-simulation (FMI) with this C inside."""
