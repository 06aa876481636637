"""Evaluation of measurements: pure functions of arrays."""
