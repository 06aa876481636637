"""Unit folders: unit.toml and the records that it names."""
