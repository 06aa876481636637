"""Instruments as the workflow reads them."""
