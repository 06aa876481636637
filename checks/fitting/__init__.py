"""Parameters fitted to measured responses."""
