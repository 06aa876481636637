"""Serials that look alike: which are asked about, in which order, and that a confirmation is asked for once."""

from pathlib import Path

import pytest

from accept.base.spelling import difference, look_alike, look_key
from accept.judging.reservations.folder_name import tell_apart, unconfirmed
from accept.store import Event, Store, open_store
from accept.store.payloads import AttemptStarted, EntryUndone


def begin(store: Store, serial: str) -> Event:
    return store.write(AttemptStarted(1, "apa", {}, ""), serial, who="Ann")


@pytest.mark.parametrize(
    ("serial", "other", "alike"),
    [
        ("APA-1O", "APA-10", True),
        ("S-0S", "S-05", True),
        ("A-S", "A-5", True),
        ("A-l1", "A-I1", True),
        ("apa-1o", "APA-10", True),
        ("A-Z1", "A-21", True),
        ("A-G", "A-6", True),
        ("A-B", "A-8", True),
        ("A-VV1", "A-W1", True),
        ("VVW-1", "WVV-I", True),
        ("W-8", "VV-B", True),
        ("A-V", "A-W", False),
        ("B-8", "8-B", False),  # a letter for a digit here, a digit for a letter there
        ("A-11", "A-12", False),
        ("A-1", "A-10", False),
        ("Q-6", "G-6", False),
    ],
)
def test_which_serials_look_alike(serial: str, other: str, alike: bool) -> None:
    assert look_alike(serial, other) is look_alike(other, serial) is alike


def test_the_key_of_the_index_is_that_of_the_program() -> None:
    """The database makes its key itself; every character that a serial may have."""
    serials = [*(f"A-{chr(code)}x" for code in range(0x21, 0x7F)), "A-vVx"]
    with open_store() as store:
        for serial in serials:
            begin(store, serial)
        for serial in serials:
            due = {s for s in serials if look_alike(s, serial) and s != serial}
            before = set(serials[: serials.index(serial)])
            assert set(store.look_alikes(serial)) == due & before, serial
    assert look_key("SOB-Il-ZGW") == "581126vv"  # without zeros and separators, which may differ


def test_the_later_of_two_is_asked_about_until_it_is_confirmed() -> None:
    with open_store() as store:
        begin(store, "APA-10")
        assert unconfirmed(store, "APA-1O") == ["APA-10"]
        begin(store, "APA-1O")
        assert unconfirmed(store, "APA-10") == []  # it was here first
        tell_apart(store, "APA-1O", "Ben")
        tell_apart(store, "APA-1O", "Ben")
        assert unconfirmed(store, "APA-1O") == []
        said = list(store.events("APA-1O", "serial_confirmed"))
        assert [(e.who, e.data["unlike"]) for e in said] == [("Ben", ["APA-10"])]
        begin(store, "APA-IO")  # a third one is asked about both
        assert unconfirmed(store, "APA-IO") == ["APA-10", "APA-1O"]


def test_a_serial_that_was_taken_off_the_list_is_not_asked_about() -> None:
    with open_store() as store:
        store.write(EntryUndone(begin(store, "APA-1O").seq), "APA-1O", who="Ann")
        assert unconfirmed(store, "APA-10") == []


def test_the_difference_is_said_by_its_place(tmp_path: Path) -> None:
    assert difference("APA-1O", "APA-10") == (
        "APA-1O differs from APA-10, which the store knows: character 6 is the letter O, not the digit 0"
    )
    assert difference("A-VV", "A-W") == "A-VV differs from A-W, which the store knows, in VV and W"
    assert difference("A-Z", "A-2").endswith("character 3 is the letter Z, not the digit 2")
