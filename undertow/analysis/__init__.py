"""Analysis: metrics, linear prediction, stability certificate."""
