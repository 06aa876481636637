"""Many units judged at once, and the files that scripts read."""
