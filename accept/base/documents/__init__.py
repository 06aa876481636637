"""The documents for other programs: one typed model of each, which writes it, reads it and fills the page of
formats."""
