"""Other people's software around undertow's parts; each package needs the extra of its name."""
