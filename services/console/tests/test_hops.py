from __future__ import annotations

import time

from hmcs.bus.messages import Origin
from hmcs_console.seeing.hops import FAST, SLOW, SPAN_NS, Arrivals, cause_of, hop_names

MS = 1_000_000


def test_a_hop_takes_from_one_message_to_the_next_of_the_same_cause() -> None:
    fast = Arrivals(FAST)
    for seq, (fixture_ms, robot_ms) in enumerate([(1, 3), (2, 5), (6, 7)]):
        begin = 10 * seq * MS + MS
        fast.came(0, ("boot", seq), begin)
        fast.came(1, ("boot", seq), begin + fixture_ms * MS)
        fast.came(2, ("boot", seq), begin + robot_ms * MS)
    assert fast.medians_ms(40 * MS) == {"input → fixture": 2.0, "fixture → robot": 2.0}


def test_messages_of_different_causes_are_not_compared() -> None:
    slow = Arrivals(SLOW)
    slow.came(0, ("boot", 1), 1 * MS)
    slow.came(1, ("boot", 2), 2 * MS)
    slow.came(1, ("another boot", 1), 3 * MS)
    assert slow.medians_ms(4 * MS) == {}


def test_it_does_not_matter_which_message_is_looked_at_first() -> None:
    slow = Arrivals(SLOW)
    slow.came(1, ("boot", 1), 9 * MS)
    slow.came(0, ("boot", 1), 4 * MS)
    assert slow.medians_ms(10 * MS) == {"step → belief": 5.0}


def test_of_messages_that_tell_of_one_cause_again_the_first_counts() -> None:
    slow = Arrivals(SLOW)
    slow.came(0, ("boot", 1), 4 * MS)
    for later_ms in (6, 16, 26):
        slow.came(1, ("boot", 1), later_ms * MS)
    assert slow.medians_ms(30 * MS) == {"step → belief": 2.0}


def test_hops_of_the_last_second_count_and_no_older_ones() -> None:
    slow = Arrivals(SLOW)
    slow.came(0, ("boot", 1), 1 * MS)
    slow.came(1, ("boot", 1), 2 * MS)
    slow.came(0, ("boot", 2), 500 * MS)
    slow.came(1, ("boot", 2), 503 * MS)
    assert slow.medians_ms(600 * MS) == {"step → belief": 2.0}
    assert slow.medians_ms(2 * MS + SPAN_NS + 1) == {"step → belief": 3.0}
    assert slow.medians_ms(503 * MS + SPAN_NS + 1) == {}


def test_only_the_newest_causes_are_kept() -> None:
    slow = Arrivals(SLOW, causes=2)
    for seq in range(3):
        slow.came(0, ("boot", seq), 1 * MS)
    slow.came(1, ("boot", 2), 2 * MS)
    slow.came(1, ("boot", 0), 9 * MS)
    assert slow.medians_ms(10 * MS) == {"step → belief": 1.0}


def test_a_thousand_samples_a_second_cost_little() -> None:
    fast, began_s = Arrivals(FAST), time.process_time()
    for seq in range(1000):
        for stage in range(len(FAST)):
            fast.came(stage, ("boot", seq), (seq + 1) * MS + stage)
        if seq % 100 == 0:
            fast.medians_ms(seq * MS)
    assert time.process_time() - began_s < 0.1


def test_a_cause_is_boot_and_number_of_the_operators_sample() -> None:
    assert cause_of(Origin(boot="b", seq=7, captured_ns=1)) == ("b", 7)
    assert hop_names(FAST) == ("input → fixture", "fixture → robot")
