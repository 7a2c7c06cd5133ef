"""Studies: the paper, figure by figure and claim by claim."""
