"""What measurements mean: pure functions of arrays."""
