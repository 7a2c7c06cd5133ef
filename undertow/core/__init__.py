"""Contracts, parameters, status codes, errors and the catalogue: the base of every other folder."""
