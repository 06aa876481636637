"""A unit folder and a spec give findings."""
