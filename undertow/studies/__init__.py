"""Many runs of a scenario: campaigns, comparisons, tuning, falsification, the arena, predictions, speed."""
