"""Verification of a certificate, and judging again from what is attached to it."""
