"""The other end of the line, written page by page from the instruments' documents: no code is shared with the drivers
or with the simulated instruments, so that a misreading shows."""
