"""Parts of a strut: each is accepted before it is built in, and stands in one strut.

For each part that a strut names the store is asked for its last verdict, what holds it since, and whether another
strut's last judgement names it too. If any of these speaks against the part, the strut is conditional at best; so is
one that was measured if its part was simulated. So it is with the parts of its parts, as their last judgements name
them. A part that the store does not know, such as a joint that is not judged as a unit, raises no doubt, unless
something wrong was noted of it. Serials that differ only in capitals are one part: the store holds no two units of such
serials (`accept.base.spelling`).
"""

from collections.abc import Iterator
from typing import NamedTuple

from accept.base.documents.results import UnitHeader
from accept.base.spelling import difference, serial_problem, spelling_key
from accept.judging.reservations.nonconformance import open_nonconformances
from accept.judging.reservations.void_attempts import voids
from accept.store import Event, Store
from accept.store.payloads import UnitJudged
from checks.verdict import UnitVerdict


class BuiltIn(NamedTuple):
    """A part of a unit, or of its parts. name: of its place; within: serials of what it stands in, the unit first;
    last: its last judgement, None without one."""

    name: str
    part: str
    within: tuple[str, ...]
    last: Event | None

    @property
    def is_within_itself(self) -> bool:
        return spelling_key(self.part) in map(spelling_key, self.within)


def parts_below(store: Store, unit: UnitHeader) -> Iterator[BuiltIn]:
    """Yield the parts of a unit and theirs, as the last judgement of each names them, once. Raises StoreError."""
    waiting, seen = list[tuple[UnitHeader, tuple[str, ...]]]([(unit, ())]), set[str]()
    while waiting:
        holder, above = waiting.pop()
        within = (*above, holder.serial)
        for name, part in sorted(holder.parts.items()):
            called = f"{holder.serial}'s {name}" if above else name
            found = BuiltIn(called, part, within, store.latest(part, UnitJudged.KIND))
            yield found
            if found.last is not None and not found.is_within_itself and spelling_key(part) not in seen:
                seen.add(spelling_key(part))
                waiting.append((UnitJudged.of(found.last).result, within))


def part_doubts(store: Store, strut: UnitHeader) -> list[str]:
    """Return the doubts about the parts of a strut, a sentence each. Raises StoreError."""
    return [words for each in parts_below(store, strut) for words in _doubts(store, strut, each)]


def _doubts(store: Store, strut: UnitHeader, built_in: BuiltIn) -> list[str]:
    name, part, within, last = built_in
    if serial_problem(part) is not None:  # a reader sees another serial in it
        return [f"{name} {part!a} has characters that no serial has, so the store cannot tell which part it is"]
    if built_in.is_within_itself:
        return [f"{name} {part} stands in itself"]
    if (known := store.other_spelling(part)) is not None:
        return [f"{name} {part} differs from {known}, which the store knows, in capitals only"]
    held = open_nonconformances(store, part, {})
    if last is None:
        noted = [f"{name} {part} is held: {'; '.join(held)}"] if held else []
        return noted + [f"{name} {difference(part, known)}" for known in store.look_alikes(part)]
    if (void := voids(store, part).get(last.seq)) is not None:
        return [f"the last judgement of {name} {part} was declared void: {void.words}"]
    result = UnitJudged.of(last).result
    accepted = result.verdict == UnitVerdict.ACCEPTED
    found = [] if accepted else [f"{name} {part} was judged '{result.verdict}' on {last.time[:10]}"]
    if accepted and held:
        found.append(f"{name} {part} is held since it was accepted: {'; '.join(held)}")
    if result.simulated and not strut.simulated:
        found.append(f"{name} {part} was simulated")
    return found + [f"{name} {part} stands in {one} too" for one in _units_with(store, part) if one != within[-1]]


def _units_with(store: Store, part: str) -> list[str]:
    """Return the serials of the units whose last judgement names the part, in any capitals."""
    latest = [store.latest(who, UnitJudged.KIND) for who in store.naming(part)]
    return [
        last.subject
        for last in latest
        if last and spelling_key(part) in map(spelling_key, UnitJudged.of(last).result.parts.values())
    ]
