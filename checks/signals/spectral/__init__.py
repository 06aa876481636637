"""Frequency responses and the quantities derived from them."""
