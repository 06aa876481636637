"""Signals that drive the rig."""
