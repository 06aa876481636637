"""Screens of the guided workflow, one file each."""
