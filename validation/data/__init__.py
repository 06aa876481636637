"""Data of the simulation: the strut with its priors, and the matrices of the shell, fetched or of beams."""
