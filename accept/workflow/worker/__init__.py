"""Computations in a process of their own."""
