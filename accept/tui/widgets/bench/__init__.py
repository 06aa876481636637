"""What the first screen shows of a bench: its units, what waits, the week, a choice of kinds."""
