"""What a bench's own store knows of a certificate: whether its recordings were given for another unit too."""

import os
from pathlib import Path

from accept.certificate.content import CertificateContent
from accept.certificate.step import Step
from accept.judging.copies import Copy, copies_of
from accept.store import StoreError, open_store


def check_copies(contents: CertificateContent) -> Step:
    """Not complete where the store has a judgement of another unit by the same samples, nobody has said whose they are,
    and the certificate counts them."""
    samples = contents.result.get("samples") or {}
    if not samples:
        return Step("")
    try:
        with open_store() as store:
            found = copies_of(store, contents.serial, None, samples)
    except StoreError as e:
        return Step(f"the bench's store was not asked for copies of its recordings: {e}")
    stated = {copy["sample"] for copy in contents.result.get("copies", []) if copy["withheld"]}
    counted = [copy for copy in found if copy["withheld"] and copy["sample"] not in stated]
    if not counted:
        return Step("the bench's store holds its recordings for no other unit")
    same = "; ".join(f"{copy['sample']} is also {_others(copy)}" for copy in counted)
    return Step(f"its recordings were given for other units too, and nobody said whose they are: {same}", False)


def _others(copy: Copy) -> str:
    return ", ".join(f"{other['serial']} {other['sample']}" for other in copy["with"])


def store_is_there(home: Path) -> bool:
    """Whether there is a store to ask; none is made for it."""
    return bool(os.environ.get("ACCEPT_STORE_URL")) or (home / "store.sqlite").is_file()
