"""The sound version beside the paper's law: the ladder once more, the ablations, and what follows from them."""
