"""The ablations A1 to A21 of the theory page: campaign files, and a verdict on each.

`undertow campaign undertow/paper/ablations/a08_sampling.yaml` runs one of them alone.
"""
