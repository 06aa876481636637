"""Which effects, together, explain the data."""
