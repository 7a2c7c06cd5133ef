"""Contracts, parameters, status codes, errors and the catalogue: what every other folder stands on."""
