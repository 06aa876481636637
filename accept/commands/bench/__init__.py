"""Commands at the bench: instruments, the guided workflow, simulated units and instruments."""
