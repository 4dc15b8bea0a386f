from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.counters import Sequences


@given(st.integers(0, 1000), st.lists(st.integers(0, 5)))
def test_lost_is_what_is_missing_between_the_first_and_the_last(first, gaps) -> None:
    sequences, seq = Sequences(), first
    lost = sequences.note("key", "boot", seq) or 0
    for gap in gaps:
        seq += gap + 1
        lost += sequences.note("key", "boot", seq) or 0
    assert lost == sum(gaps)


@given(st.integers(0, 1000))
def test_the_first_message_of_a_boot_is_no_gap_whatever_its_number(seq) -> None:
    sequences = Sequences()
    assert sequences.note("key", "one", seq) == 0
    assert sequences.note("key", "two", 0) == 0
    assert sequences.note("other", "one", 0) == 0


@given(st.lists(st.integers(0, 20), min_size=1))
def test_duplicates_and_overtaken_ones_are_no_news_and_no_loss(seqs) -> None:
    sequences, highest = Sequences(), None
    for seq in seqs:
        lost = sequences.note("key", "boot", seq)
        if highest is not None and seq <= highest:
            assert lost is None
        else:
            assert lost == (0 if highest is None else seq - highest - 1)
            highest = seq


@given(st.integers(0, 10), st.integers(0, 10))
def test_what_was_overwritten_in_the_mailbox_is_not_lost_on_the_wire(gap, overwritten) -> None:
    sequences = Sequences()
    sequences.note("key", "boot", 0)
    assert sequences.note("key", "boot", 1 + gap, overwritten) == max(0, gap - overwritten)


def test_boots_long_gone_are_forgotten() -> None:
    sequences = Sequences()
    for boot in range(10_000):
        sequences.note("key", str(boot), 0)
    assert len(sequences._expected) < 10_000
    assert sequences.note("key", "9999", 2) == 1
