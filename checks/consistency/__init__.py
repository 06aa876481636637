"""Measurements of one unit that must agree with each other, or none of them counts."""
