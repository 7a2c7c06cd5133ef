"""Mathematics without vehicles: rotations, integrators, inverses, Lyapunov equations, smoothing."""
