"""The arena: fixed benchmark tasks on four vehicles, which any control law runs with one command, and their scores."""
