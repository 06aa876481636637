"""Labels of quantities for people; code names are for files and details."""

from functools import cache


@cache
def label_of(quantity: str) -> str:
    """Return the label that the quantity's check declares, else words from its name."""
    from checks.acceptance import label_of as declared  # loads slowly: only when a label is asked for

    return declared(quantity)


def check_label(check: str) -> str:
    """Return the name of a check as people read it; of one that is not installed, words from its name."""
    from checks.acceptance import CHECKS

    return (CHECKS[check].short or CHECKS[check].title) if check in CHECKS else check.replace("_", " ")


def label_and_name(quantity: str) -> str:
    """Return `Misalignment dy (dy_um)`: the label, and the code name that commands take."""
    return f"{label_of(quantity)} ({quantity})"
