"""Merkle trees of [RFC6962] 2.1: proofs that a list was only appended to."""

import hashlib
from collections.abc import Sequence

Hash = bytes


def leaf_hash(entry: bytes) -> Hash:
    """Return the hash of an entry."""
    return hashlib.sha256(b"\x00" + entry).digest()


def node_hash(left: Hash, right: Hash) -> Hash:
    """Return the hash of a node over its two children."""
    return hashlib.sha256(b"\x01" + left + right).digest()


def root(leaves: Sequence[Hash]) -> Hash:
    """Return the root of the tree over the hashes of its leaves, in order."""
    if not leaves:
        return hashlib.sha256(b"").digest()
    if len(leaves) == 1:
        return leaves[0]
    split = _split(len(leaves))
    return node_hash(root(leaves[:split]), root(leaves[split:]))


def consistency_proof(leaves: Sequence[Hash], earlier: int) -> list[Hash]:
    """Return the proof that the first `earlier` leaves were a tree of their own once ([RFC6962] 2.1.2). Raises
    IndexError for a size that the tree never had."""
    if not 0 < earlier <= len(leaves):
        raise IndexError(f"a tree of {len(leaves)} leaves never had {earlier}")
    return _subproof(leaves, earlier, whole=True)


def is_consistent(earlier: int, size: int, first: Hash, second: Hash, proof: Sequence[Hash]) -> bool:
    """Return whether a tree of `size` leaves with the root `second` has the tree of `earlier` leaves with the root
    `first` as its beginning ([RFC9162] 2.1.4.2)."""
    if earlier == size:
        return first == second and not proof
    if not 0 < earlier < size or not proof:
        return False
    path = [first, *proof] if earlier & (earlier - 1) == 0 else list(proof)
    place, last = earlier - 1, size - 1
    while place % 2:
        place, last = place >> 1, last >> 1
    old = new = path[0]
    for other in path[1:]:
        if last == 0:
            return False
        if place % 2 or place == last:
            old, new = node_hash(other, old), node_hash(other, new)
            while not place % 2 and place:
                place, last = place >> 1, last >> 1
        else:
            new = node_hash(new, other)
        place, last = place >> 1, last >> 1
    return last == 0 and old == first and new == second


def _subproof(leaves: Sequence[Hash], earlier: int, whole: bool) -> list[Hash]:
    if earlier == len(leaves):
        return [] if whole else [root(leaves)]
    split = _split(len(leaves))
    if earlier <= split:
        return [*_subproof(leaves[:split], earlier, whole), root(leaves[split:])]
    return [*_subproof(leaves[split:], earlier - split, whole=False), root(leaves[:split])]


def _split(count: int) -> int:
    """Return the largest power of two below a count above one."""
    return 1 << ((count - 1).bit_length() - 1)
