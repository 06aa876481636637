"""Frequency responses and what is read off them."""
