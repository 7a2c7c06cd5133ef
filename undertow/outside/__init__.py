"""undertow in other people's programs: stepped or timed by them, exported, and linked; most packages need an extra."""
