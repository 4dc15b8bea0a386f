from __future__ import annotations

import time

import msgpack
import numpy as np
import pytest
import zenoh

from hmcs.bus.config import BusSettings
from hmcs.bus.examples import ENVELOPE
from hmcs.bus.keys import KeyNameError
from hmcs.bus.messages import Ask, Motion, Origin, Source, Step
from hmcs.bus.session import Bus, BusUnavailableError, StoppedError
from hmcs.bus.wire import decode, encode

ORIGIN = Origin(boot="hand", seq=3, captured_ns=7)


def motion(x: float) -> Motion:
    return Motion(position=np.array([x, 0.0, 0.0]), velocity=np.zeros(3), dead_man=True)


def step(index: int) -> Step:
    return Step(index=index, position=np.zeros(3), displacement=np.ones(3))


@pytest.fixture
def pair(join, until):
    """A bus that publishes, one that receives, and how to wait until they see each other."""
    sender, receiver = join("sender"), join("receiver")

    def publisher(message_type, key):
        made = sender.publisher(message_type, key)
        until(lambda: made.matching)
        return made

    return sender, receiver, publisher


def receive(receiver: Bus, got: list, count: int) -> None:
    deadline_s = time.monotonic() + 10
    while len(got) < count:
        assert time.monotonic() < deadline_s, f"{len(got)} of {count} came"
        receiver.pump(0.1)


def wait_for_arrival(receiver: Bus, until, count: int) -> None:
    """Until `count` things are in the mailbox, unhandled."""
    until(lambda: receiver._mailbox.pending() >= count)


# --- publish and subscribe ------------------------------------------------------------------------


def test_keep_all_arrives_in_order_with_its_envelope(pair) -> None:
    sender, receiver, publisher = pair
    got = []
    receiver.subscribe(Step, receiver.keys.step, got.append)
    put = publisher(Step, sender.keys.step).put
    sent = [put(step(index), ORIGIN) for index in range(200)]
    receive(receiver, got, 200)
    assert [received.body.index for received in got] == list(range(200))
    assert [received.envelope for received in got] == sent
    assert got[0].envelope.source == sender.source
    assert got[0].envelope.origin == ORIGIN
    assert got[0].key == sender.keys.step
    assert sender.counters.sent["step"] == receiver.counters.received["step"] == 200
    assert not receiver.counters.lost


def test_where_the_newest_wins_a_slow_receiver_gets_it_alone_and_nothing_counts_as_lost(
    pair, until
) -> None:
    sender, receiver, publisher = pair
    got, marks = [], []
    receiver.subscribe(Motion, receiver.keys.motion, got.append)
    receiver.subscribe(Step, receiver.keys.step, marks.append)
    moves, marker = publisher(Motion, sender.keys.motion), publisher(Step, sender.keys.step)
    for x in range(50):
        moves.put(motion(x))
    # Steps travel behind motions, so with the step all of them are there.
    marker.put(step(0))
    wait_for_arrival(receiver, until, 2)
    receive(receiver, marks, 1)
    assert [received.body.position[0] for received in got] == [49.0]
    assert receiver.counters.received["motion"] == 50
    assert not receiver.counters.lost
    moves.put(motion(50))
    receive(receiver, got, 2)
    assert not receiver.counters.lost


def test_a_message_that_may_be_dropped_does_not_travel_express(pair, until) -> None:
    """Both together would lose up to a third of the messages of a link that several share."""
    sender, receiver, publisher = pair
    samples: list[zenoh.Sample] = []
    listening = receiver._session.declare_subscriber(receiver.keys.step, samples.append)
    publisher(Step, sender.keys.step).put(step(0))
    until(lambda: samples)
    listening.undeclare()
    drops = samples[0].congestion_control == zenoh.CongestionControl.DROP
    assert not (drops and samples[0].express)


def test_two_subscriptions_of_one_bus_both_get_every_message(pair) -> None:
    sender, receiver, publisher = pair
    first, second = [], []
    receiver.subscribe(Motion, receiver.keys.motion, first.append)
    receiver.subscribe(Motion, receiver.keys.motion, second.append)
    put = publisher(Motion, sender.keys.motion).put
    for x in range(3):
        put(motion(x))
        receive(receiver, second, x + 1)
    assert [r.body.position[0] for r in first] == [r.body.position[0] for r in second] == [0, 1, 2]
    assert not receiver.counters.late
    assert not receiver.counters.lost


def test_arrival_is_reported_by_the_local_monotonic_clock(pair) -> None:
    sender, receiver, publisher = pair
    got = []
    receiver.subscribe(Step, receiver.keys.step, got.append)
    put = publisher(Step, sender.keys.step).put
    before_ns = time.monotonic_ns()
    put(step(0))
    receive(receiver, got, 1)
    assert before_ns < got[0].received_ns < time.monotonic_ns()


def test_cells_do_not_hear_each_other(router, until) -> None:
    with (
        Bus.open(BusSettings(router=router, cell="one"), "tester", "a") as one,
        Bus.open(BusSettings(router=router, cell="two"), "tester", "a") as two,
    ):
        got = []
        two.subscribe(Step, two.keys.step, got.append)
        one.subscribe(Step, one.keys.step, got.append)
        mine = two.publisher(Step, two.keys.step)
        until(lambda: mine.matching)
        one.publisher(Step, one.keys.step).put(step(1))
        receive(one, got, 1)
        mine.put(step(2))
        receive(two, got, 2)
        assert [received.body.index for received in got] == [1, 2]


def test_what_has_no_stance_cannot_be_published_or_subscribed(join) -> None:
    bus = join()
    with pytest.raises(ValueError, match="Ask is not published"):
        bus.publisher(Ask, bus.keys.motion)
    with pytest.raises(ValueError, match=r"those that have: .*Motion"):
        bus.subscribe(Ask, bus.keys.motion, lambda _: None)


# --- sequence numbers -----------------------------------------------------------------------------


@pytest.fixture
def raw(pair, until):
    """A way to put arbitrary bytes on the key of steps, and what the receiver made of them."""
    sender, receiver, _ = pair
    got = []
    receiver.subscribe(Step, receiver.keys.step, got.append)
    publisher = sender._session.declare_publisher(
        sender.keys.step,
        priority=zenoh.Priority.INTERACTIVE_HIGH,
    )
    until(lambda: publisher.matching_status.matching)
    return publisher.put, receiver, got


def numbered(seq: int, boot: str = "boot") -> bytes:
    source = Source(service="sender", instance="a", boot=boot)
    return encode(step(seq), ENVELOPE.model_copy(update={"source": source, "seq": seq}))


def test_gaps_are_counted_for_each_boot_and_duplicates_are_no_loss(raw) -> None:
    put, receiver, got = raw
    for data in (
        *map(numbered, (5, 6, 9, 9, 7, 10)),
        *(numbered(seq, "another-boot") for seq in (0, 1, 4)),
        numbered(11),
    ):
        put(data)
    receive(receiver, got, 10)
    assert receiver.counters.lost == {"step": 2 + 2}
    assert receiver.counters.received == {"step": 10}


def test_malformed_messages_are_refused_counted_logged_and_the_loop_goes_on(raw, caplog) -> None:
    put, receiver, got = raw
    wrong_shape = msgpack.unpackb(numbered(1))
    wrong_shape["position"]["shape"] = [2]
    put(numbered(0))
    put(b"no msgpack at all")
    put(b"")
    put(msgpack.packb(wrong_shape))
    put(encode(motion(0.0), ENVELOPE))
    put(numbered(2))
    receive(receiver, got, 2)
    assert [received.body.index for received in got] == [0, 2]
    assert receiver.counters.refused == {"step": 4}
    # Number 1 did arrive.
    assert not receiver.counters.lost
    reported = [r for r in caplog.records if r.getMessage() == "message refused"]
    assert len(reported) == 1
    assert "not a msgpack message" in reported[0].reason


def test_an_exception_of_a_handler_leaves_the_pump_and_the_rest_stays_pending(pair, until) -> None:
    sender, receiver, publisher = pair
    got = []

    def handle(received) -> None:
        if received.body.index == 1:
            raise RuntimeError("boom")
        got.append(received.body.index)

    receiver.subscribe(Step, receiver.keys.step, handle)
    put = publisher(Step, sender.keys.step).put
    for index in range(4):
        put(step(index))
    wait_for_arrival(receiver, until, 4)
    with pytest.raises(RuntimeError, match="boom"):
        receiver.pump(1.0)
    receive(receiver, got, 3)
    assert got == [0, 2, 3]


# --- the loop -------------------------------------------------------------------------------------


def test_pump_returns_when_there_is_nothing_to_do(join) -> None:
    bus = join()
    assert bus.pump(0.0) == 0
    assert bus.pump(0.01) == 0


def test_timers_fire_at_their_rate_until_they_are_cancelled(join) -> None:
    bus = join()
    ticks, once = [], []
    began_ns = time.monotonic_ns()

    def tick() -> None:
        ticks.append(time.monotonic_ns() - began_ns)
        if len(ticks) == 5:
            timer.cancel()

    timer = bus.every(0.01, tick)
    bus.at(began_ns + 35_000_000, lambda: once.append(time.monotonic_ns() - began_ns))
    while time.monotonic_ns() - began_ns < 120_000_000:
        bus.pump(0.02)
    assert len(ticks) == 5
    # Never early; skipped where the machine was late.
    assert all(at_ns >= 10_000_000 * (n + 1) for n, at_ns in enumerate(ticks))
    assert len(once) == 1
    assert once[0] >= 35_000_000


@pytest.mark.parametrize("period_s", [0.0, -1.0, float("nan")])
def test_a_period_is_a_positive_number_of_seconds(join, period_s) -> None:
    with pytest.raises(ValueError, match="period_s"):
        join().every(period_s, lambda: None)


def test_a_steady_stream_does_not_hold_up_timers_or_the_caller(join) -> None:
    bus = join()
    ticks, handled = [], []

    def again() -> None:
        handled.append(1)
        bus._mailbox.put(again)

    bus._mailbox.put(again)
    bus.every(0.005, lambda: ticks.append(1))
    deadline_s = time.monotonic() + 10
    while len(ticks) < 3:
        assert time.monotonic() < deadline_s
        bus.pump(1.0)
    assert handled


# --- routers that are not there, come, go ---------------------------------------------------------


def test_no_router_within_the_time_set_is_a_clear_error(free_endpoint) -> None:
    settings = BusSettings(router=free_endpoint, connect_timeout_s=0.1)
    with pytest.raises(BusUnavailableError, match=f"no router at {free_endpoint}.*hmcs router"):
        Bus.open(settings, "tester", "a")


def test_waiting_for_a_router_says_so_and_ends_when_asked(free_endpoint, caplog) -> None:
    def stopping() -> bool:
        return any("waiting for a router" in record.getMessage() for record in caplog.records)

    with pytest.raises(StoppedError):
        Bus.open(BusSettings(router=free_endpoint), "tester", "a", stopping=stopping)
    assert caplog.records[0].router == free_endpoint


def test_everything_goes_on_by_itself_when_the_router_is_restarted(
    restartable_router, until
) -> None:
    restartable_router.start()
    settings = BusSettings(router=restartable_router.endpoint)
    with (
        Bus.open(settings, "sender", "a") as sender,
        Bus.open(settings, "receiver", "a") as receiver,
    ):
        got, seen = [], []
        receiver.subscribe(Step, receiver.keys.step, got.append)
        receiver.watch(receiver.keys.presence(), lambda _, alive: seen.append(alive))
        sender.answer("health", Ask, lambda _: Ask())
        sender.announce(sender.keys.presence("sender", "a"))
        publisher = sender.publisher(Step, sender.keys.step)
        until(lambda: publisher.matching)
        publisher.put(step(0))
        receive(receiver, got, 1)
        receive(receiver, seen, 1)

        restartable_router.stop()
        until(lambda: not sender.connected and not receiver.connected)
        publisher.put(step(1))
        receive(receiver, seen, 2)

        restartable_router.start()
        until(lambda: sender.connected and receiver.connected and publisher.matching)
        publisher.put(step(2))
        receive(receiver, got, 2)
        receive(receiver, seen, 3)
        assert [received.body.index for received in got] == [0, 2]
        assert seen == [True, False, True]
        assert receiver.counters.lost == {"step": 1}
        until(lambda: receiver.alive(receiver.keys.presence()))


# --- opening --------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", ["a*", "a$b", "a/b", ""])
def test_names_that_mean_something_in_keys_are_refused(free_endpoint, bad) -> None:
    settings = BusSettings(router=free_endpoint)
    with pytest.raises(KeyNameError, match="cannot be part of a key"):
        Bus.open(settings, bad, "a")
    with pytest.raises(KeyNameError, match="cannot be part of a key"):
        Bus.open(settings, "tester", bad)
    with pytest.raises(ValueError, match="cannot be part of a key"):
        BusSettings(cell=bad)


def test_a_bus_can_be_closed_twice(router) -> None:
    bus = Bus.open(BusSettings(router=router), "tester", "a")
    bus.close()
    bus.close()


def test_each_start_is_a_new_boot(join) -> None:
    assert join().source.boot != join().source.boot


def test_direct_processes_hear_each_other_and_those_behind_the_router(join, until) -> None:
    sender = join("sender", direct=True)
    near, far = join("near", direct=True), join("far")
    got_near, got_far = [], []
    near.subscribe(Step, near.keys.step, got_near.append)
    far.subscribe(Step, far.keys.step, got_far.append)
    until(lambda: sender._session.info.peers_zid())
    publisher = sender.publisher(Step, sender.keys.step)
    deadline_s = time.monotonic() + 10
    index = 0
    while not (got_near and got_far):
        assert time.monotonic() < deadline_s
        publisher.put(step(index))
        index += 1
        near.pump(0.05)
        far.pump(0.05)
    assert not near.counters.lost
    indices = [received.body.index for received in got_near]
    assert indices == sorted(set(indices))


def test_a_listener_gets_everything_in_order_as_it_came(pair) -> None:
    sender, listener, publisher = pair
    got = []
    listener.listen(listener.keys.everything, got.append, every_s=0.005)
    put_motion = publisher(Motion, sender.keys.motion).put
    put_step = publisher(Step, sender.keys.step).put
    for k in range(50):
        put_motion(motion(k))
        put_step(step(k))
    receive(listener, got, 100)
    assert sorted({arrival.key for arrival in got}) == [sender.keys.motion, sender.keys.step]
    of_motion = [arrival for arrival in got if arrival.key == sender.keys.motion]
    reported = [decode(arrival.payload, Motion)[1] for arrival in of_motion]
    assert [body.position[0] for body in reported] == list(range(50))
