"""The robust variant of the paper's law: the same structure, exact in discrete time, with actuator limits."""
