"""What a person types, in which unit."""
