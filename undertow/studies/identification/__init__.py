"""Identification: the numbers of a vehicle from its logs, and how sure they are."""
