"""Pictures: panels, which are data, drawn with matplotlib for files and for the certificate."""
