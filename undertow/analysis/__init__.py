"""Analysis: metrics, linearisation, stability certificate."""
