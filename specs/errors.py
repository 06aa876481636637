"""The root of every error that a person can cause or mend; its text states the fault and the remedy."""


class AcceptError(Exception):
    """An unusable input, file, setting or instrument. A fault of the program is not an AcceptError."""
