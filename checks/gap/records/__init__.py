"""What the gap analysis works on."""
