"""Data of the simulation: the strut with its priors, and the matrices of the shell once they are fetched."""
