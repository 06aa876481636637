"""Typed entries: value and unit."""
