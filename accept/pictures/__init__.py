"""Pictures: panels, which are data, drawn with matplotlib for files and, by `pdf`, on pages."""
