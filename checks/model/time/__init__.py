"""The modelled unit in time."""
