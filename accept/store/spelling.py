"""Serials that differ only in capitals: on a file system that does not distinguish them, their certificates and folders
would overwrite each other."""


def spelling_key(serial: str) -> str:
    """Return the key that such serials share. A serial is ASCII (`accept.units.unit_folder`): no letter has two
    forms."""
    return serial.casefold()


def mistaken_for(serial: str, known: str) -> str:
    """Return the message that refuses such a serial."""
    return (
        f"serial = '{serial}' differs from '{known}', which the bench's store knows, in capitals only; "
        "some file systems take both for one, and the certificates would overwrite each other"
    )
