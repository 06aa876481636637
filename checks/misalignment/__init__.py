"""Misalignment of the APA between its joints."""
