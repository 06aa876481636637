"""Signal processing, independent of the check that uses it."""
