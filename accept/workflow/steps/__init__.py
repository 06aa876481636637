"""The steps of a unit, from its spec and its checks."""
