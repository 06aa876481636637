"""Certificates: content, page, the keys that are trusted, signatures, and their verification."""
