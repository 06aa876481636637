"""A model with effects in it."""
