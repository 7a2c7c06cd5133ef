"""The ablations A1 to A21 of the theory page: one file per question.

Each has a `QUESTION`, the theory's `PREDICTION`, `METRICS` to be told, `variants(quick)` of one closed loop and
`judge(found)`, which puts the numbers into words; `LEFT_OUT` says what of the question is not looked at.
"""
