"""Contracts, parameters, status codes, errors, the catalogue and numerics: the base of every other room."""
