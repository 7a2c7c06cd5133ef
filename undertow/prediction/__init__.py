"""What will happen, before anything is run."""
