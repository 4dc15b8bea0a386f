from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.counters import LARGEST_GAP, Sequences


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


@given(st.lists(st.integers(0, 3), min_size=1), st.data())
def test_a_message_that_comes_again_is_no_news_and_no_loss(gaps, data) -> None:
    sequences, seq, came = Sequences(), 0, []
    for gap in gaps:
        seq += gap + 1
        sequences.note("key", "boot", seq)
        came.append(seq)
        assert sequences.note("key", "boot", data.draw(st.sampled_from(came))) is None
        assert sequences.note("key", "boot", seq + 1) == 0
        seq += 1
        came.append(seq)


@given(st.integers(0, 2**53), st.integers(2, 400))
def test_one_message_with_any_number_makes_no_later_one_of_the_true_source_late(forged, at) -> None:
    sequences = Sequences()
    news = []
    for seq in range(at + 200):
        if seq == at:
            sequences.note("key", "boot", forged)
        news.append(sequences.note("key", "boot", seq))
    # The one that it took the number of cannot be distinguished from it.
    assert news.count(None) <= (forged == at)


@given(st.lists(st.integers(0, 2**53), min_size=1, max_size=60))
def test_a_source_goes_on_between_any_forgeries_of_it(forged) -> None:
    sequences, news = Sequences(), []
    for seq in range(100):
        news.append(sequences.note("key", "boot", seq))
    for number in forged:
        sequences.note("key", "boot", number)
        seq += 1
        news.append(sequences.note("key", "boot", seq))
    assert news.count(None) <= sum(100 <= number < 200 for number in forged)


@given(st.integers(LARGEST_GAP + 2, 2**52), st.integers(5000, 9000))
def test_a_source_that_jumps_is_heard_again_with_its_second_message(jump, start) -> None:
    for to in (start + jump, max(0, start - jump)):
        sequences = Sequences()
        sequences.note("key", "boot", start)
        assert sequences.note("key", "boot", to) is None
        assert sequences.note("key", "boot", to + 1) == 0


def test_a_jump_that_nothing_confirms_is_forgotten_once_the_source_goes_on() -> None:
    sequences = Sequences()
    sequences.note("key", "boot", 0)
    for seq in range(1, 50):
        assert sequences.note("key", "boot", 10**6 + seq) is None
        assert sequences.note("key", "boot", seq) == 0


def test_a_loss_of_each_of_many_sources_is_seen() -> None:
    """A hundred processes with ten keys each."""
    sequences = Sequences()
    boots = [str(number) for number in range(1000)]
    for boot in boots:
        sequences.note("key", boot, 0)
    assert [sequences.note("key", boot, 3) for boot in boots] == [2] * len(boots)


@given(st.integers(0, 10), st.integers(0, 10))
def test_what_was_overwritten_in_the_mailbox_is_not_lost_on_the_wire(gap, overwritten) -> None:
    sequences = Sequences()
    sequences.note("key", "boot", 0)
    assert sequences.note("key", "boot", 1 + gap, overwritten) == max(0, gap - overwritten)


def test_boots_long_gone_are_forgotten() -> None:
    sequences = Sequences()
    for boot in range(10_000):
        sequences.note("key", str(boot), 0)
    assert len(sequences._sources) < 10_000
    assert sequences.note("key", "9999", 2) == 1
