"""Tuning of controllers: tunable parameters, training runs, cost, search and certificate."""
