"""Who may sign: the authority, the persons' keys and what it revoked; the spec and the bench that it vouches for."""
