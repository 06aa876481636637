"""How the effective dimensions of the frame APA were identified."""
