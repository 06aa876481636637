"""The content of a certificate, its provenance, and its statements."""
