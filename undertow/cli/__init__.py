"""The command line: commands, nothing else. Nothing heavy is imported before a command runs."""
