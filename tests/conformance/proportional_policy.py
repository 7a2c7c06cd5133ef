"""A policy that somebody wrote: shares of the input proportional to the errors."""


def act(seen):
    return 0.05 * seen[:8]
