"""First guesses that start the refinement."""
