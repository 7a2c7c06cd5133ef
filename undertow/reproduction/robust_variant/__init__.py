"""The robust variant beside the paper's law: every fidelity once more, the ablations, and what follows from them."""
