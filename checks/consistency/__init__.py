"""Consistency of the measurements of one unit; those that contradict each other do not count."""
