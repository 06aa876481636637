"""Studies on drawn units: methods side by side, gates left out, thresholds and priors, coverage of intervals."""
