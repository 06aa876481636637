"""The root of every error that a person can cause or mend: its text names what is wrong and the way out."""


class AcceptError(Exception):
    """An input, a file, a setting or an instrument that cannot be used. A fault of the program is not an
    AcceptError."""
