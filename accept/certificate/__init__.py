"""Certificates: content, page, the keys that are trusted, signatures, and their verification."""

from accept.certificate.deferred_imports import defer

defer()  # before anything here loads pyHanko
