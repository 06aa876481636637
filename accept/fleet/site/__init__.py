"""A static page of the fleet that works from a file, offline."""
