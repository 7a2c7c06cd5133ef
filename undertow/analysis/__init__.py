"""What is known of a loop and of a run: linearization, margins, metrics, stability certificate, requirements."""
