"""Models and misalignment tables as files."""
