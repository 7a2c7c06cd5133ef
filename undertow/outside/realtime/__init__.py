"""The controller of a scenario in real time: a loop with a deadline, links to a vehicle, statistics."""
