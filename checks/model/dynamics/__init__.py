"""Modes and derivatives."""
