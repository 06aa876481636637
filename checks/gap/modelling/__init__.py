"""A model with effects in it, and the numbers by which an explanation is judged."""
