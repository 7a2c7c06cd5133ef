"""Monte Carlo studies and parameter sweeps: sampling, batches of runs, the results store and its evaluation."""
