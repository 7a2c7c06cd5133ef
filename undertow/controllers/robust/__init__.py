"""The sound version of the paper's law: the same structure, exact in discrete time, within its limits."""
