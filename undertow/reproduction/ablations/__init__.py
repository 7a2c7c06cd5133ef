"""The ablations A1 to A21 of the theory page: campaign files, a verdict on each, and what they add up to.

`undertow campaign undertow/reproduction/ablations/a08_sampling.yaml` runs one of them alone.
"""
