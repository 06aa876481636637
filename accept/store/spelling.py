"""Serials that differ in capitals only: a file system that takes them for one lets their certificates and folders
overwrite each other."""

NAMING = ("unit_judged", "attempt_started")  # the events that bring a unit into the store


def spelling_key(serial: str) -> str:
    """What two such serials share. A serial is ASCII (`accept.units.unit_folder`): no letter has two forms."""
    return serial.casefold()


def mistaken_for(serial: str, known: str) -> str:
    """Why a serial is refused."""
    return (
        f"serial = '{serial}' differs from '{known}', which the bench's store knows, in capitals only; "
        "some file systems take both for one, and the certificates would overwrite each other"
    )
