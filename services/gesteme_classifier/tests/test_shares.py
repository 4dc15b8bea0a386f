"""Shares: everything is held, evenly, and a change of membership moves as little as it can."""

from hypothesis import given
from hypothesis import strategies as st

from hmcs_gesteme_classifier.shares import share_of

names = st.text(alphabet="abcdef0123456789", min_size=1, max_size=6)
members_of = st.sets(names, min_size=1, max_size=6)
gestemes_of = st.lists(names, min_size=1, max_size=25, unique=True)
redundancies = st.integers(1, 3)


@given(members_of, gestemes_of, redundancies)
def test_each_gesteme_is_held_by_as_many_as_asked_or_by_all(members, gestemes, redundancy):
    shares = {m: share_of(m, members, gestemes, redundancy) for m in members}
    for g in range(len(gestemes)):
        holders = [m for m in members if g in shares[m]]
        assert len(holders) == min(redundancy, len(members))


@given(members_of, names, gestemes_of, redundancies)
def test_who_joins_only_takes_over(members, newcomer, gestemes, redundancy):
    before = members - {newcomer}
    for m in before:
        grown = share_of(m, before | {newcomer}, gestemes, redundancy)
        assert grown <= share_of(m, before, gestemes, redundancy)


@given(st.sets(names, min_size=2, max_size=6), gestemes_of, redundancies)
def test_who_leaves_only_hands_on_its_own(members, gestemes, redundancy):
    leaver = min(members)
    left = share_of(leaver, members, gestemes, redundancy)
    for m in members - {leaver}:
        gained = share_of(m, members - {leaver}, gestemes, redundancy) - share_of(
            m, members, gestemes, redundancy
        )
        assert gained <= left


def test_the_work_is_divided_evenly():
    gestemes = [f"g{k}" for k in range(400)]
    sizes = [len(share_of(m, {"a", "b", "c", "d"}, gestemes, 1)) for m in "abcd"]
    assert min(sizes) > 60
