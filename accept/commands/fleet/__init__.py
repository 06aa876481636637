"""Commands that ask the store about many units."""
