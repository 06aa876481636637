"""Effects of masses, stiffnesses, geometry and modes."""
