"""The simulated strut on its bench."""
