"""Scores of the blind tests against their targets, their reports, and the finished units on disk."""
