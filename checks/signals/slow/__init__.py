"""Slow signals: steps, creep, loops, sweeps."""
