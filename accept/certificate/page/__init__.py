"""The page: what is the same on each, its body, and the whole document to the byte."""
