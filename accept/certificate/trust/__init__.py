"""Trust: the authority, the persons' keys, the keys that it revoked, and the specs and benches that it certifies."""
