"""Signals, whatever they are measured for."""
