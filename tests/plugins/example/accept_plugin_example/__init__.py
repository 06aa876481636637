"""What another lab adds to accept: an effect, a check, an instrument."""
