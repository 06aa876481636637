"""Readings and records taken at the bench, into the unit folder and the store."""
