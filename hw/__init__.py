"""Sources of measurements: instruments, records, superelements, and their simulation."""
