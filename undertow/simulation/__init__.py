"""The closed loop, and many of them: loops by the batch compiler or XLA, groups that share a program, executors."""
