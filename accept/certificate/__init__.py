"""Certificates: drawn to the byte, signed by technician and quality assurance."""
