"""Models that come with the program, and the declaration of their parameters."""
