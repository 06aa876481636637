"""The check of the frequency responses."""
