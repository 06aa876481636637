"""Limits and nominal models as TOML, and the only code that reads them."""
