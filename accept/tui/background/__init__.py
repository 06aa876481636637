"""Slow work behind a screen."""
