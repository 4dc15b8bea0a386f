"""Who holds which gesteme: rendezvous hashing over the peers that are there.

Every peer works it out alone and comes to the same answer. A peer that joins only takes gestemes
over, a peer that leaves only hands its own on: nobody else's share changes.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Sequence


def share_of(
    member: str, members: Collection[str], gestemes: Sequence[str], redundancy: int
) -> frozenset[int]:
    """Return the indices of the gestemes that `member`, one of `members`, is to hold.

    Each gesteme is held by the `redundancy` members that rank highest for it, or by all while
    there are fewer.
    """
    return frozenset(
        g
        for g, gesteme in enumerate(gestemes)
        if member in sorted(members, key=lambda m: _rank(m, gesteme))[:redundancy]
    )


def _rank(member: str, gesteme: str) -> bytes:
    return hashlib.blake2b(f"{member}|{gesteme}".encode(), digest_size=8).digest()
