"""The signatures on the page, from a key in a file or in a token, with their stamp and their timestamp."""
