"""Both buses keep the same promises."""

import queue
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from tui_gcs.core.protocol.bus import Bus, BusError, MemoryBus, matches
from tui_gcs.core.protocol.zenoh_bus import QueuedBus, connect, serve


@pytest.fixture(params=["memory", "zenoh"])
def ends(request: pytest.FixtureRequest, tmp_path: Path):
    """(station's end, console's end)"""
    if request.param == "memory":
        bus = MemoryBus()
        yield bus, bus
        return
    station = serve(tmp_path / "s")
    console = connect(tmp_path / "s")
    yield station, console
    console.close()
    station.close()


def test_a_question_is_answered_with_its_key_and_payload(ends: tuple[Bus, Bus]):
    station, console = ends
    station.answer("gcs/req/*", lambda key, data, reply: reply(f"{key}:{data.decode()}".encode()))
    assert console.ask("gcs/req/me", b"hello") == b"gcs/req/me:hello"


def test_samples_reach_subscribers_of_their_key_only(ends: tuple[Bus, Bus]):
    station, console = ends
    got: queue.Queue[tuple[str, bytes]] = queue.Queue()
    console.subscribe("gcs/planner/*/plan", lambda key, data: got.put((key, data)))
    # a round trip: Zenoh has told the station of the subscription before it answers
    station.answer("gcs/req/*", lambda key, data, reply: reply(b""))
    console.ask("gcs/req/me", b"")
    station.publish("gcs/planner/plan", b"no")
    station.publish("gcs/planner/red/plan", b"yes")
    assert got.get(timeout=5) == ("gcs/planner/red/plan", b"yes")
    assert got.empty()


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="only Linux tells what is mapped")
def test_large_samples_take_no_shared_memory_that_a_killed_process_would_leave(ends: tuple[Bus, Bus]):
    station, console = ends
    station.answer("gcs/req/*", lambda key, data, reply: reply(data))
    assert console.ask("gcs/req/me", bytes(100_000)) == bytes(100_000)
    assert ".zenoh" not in Path("/proc/self/maps").read_text()


def test_questions_arrive_in_the_order_in_which_they_are_begun(ends: tuple[Bus, Bus]):
    """A hold must not overtake what it stops; see `tui_gcs.feed.bus_questions`."""
    station, console = ends
    arrived: list[bytes] = []

    def on_question(key: str, data: bytes, reply: Callable[[bytes], None]) -> None:
        arrived.append(data)
        reply(data)

    station.answer("gcs/req/*", on_question)
    answers: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    for number in range(200):
        console.begin("gcs/req/me", b"%d" % number, answers.put, late=number % 2 == 0)
    assert {answers.get(timeout=5) for _ in range(200)} == {b"%d" % number for number in range(200)}
    assert arrived == [b"%d" % number for number in range(200)]


def test_a_question_that_is_not_answered_ends_once_without_an_answer(ends: tuple[Bus, Bus]):
    _, console = ends
    answers: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    console.begin("gcs/req/nobody", b"", answers.put, 0.3)
    assert answers.get(timeout=5) is None
    assert answers.empty()


def test_nobody_answers(ends: tuple[Bus, Bus]):
    _, console = ends
    with pytest.raises(BusError):
        console.ask("gcs/req/nobody", b"", timeout_s=0.3)


def test_what_nobody_waits_for_any_more_is_not_done_but_for_a_stop(tmp_path: Path):
    served = serve(tmp_path / "s")
    arrived = threading.Event()
    station = QueuedBus(served, arrived.set)
    console = connect(tmp_path / "s")
    done: list[bytes] = []
    station.answer("gcs/req/*", lambda key, data, reply: done.append(data))
    answers: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    for data, late in ((b"start", False), (b"hold", True)):
        arrived.clear()
        # The station's loop stands still: a busy disk, a SIGSTOP.
        console.begin("gcs/req/me", data, answers.put, 0.2, late=late)
        assert arrived.wait(5)
        assert answers.get(timeout=5) is None
    station.run_pending()
    assert done == [b"hold"]
    console.close()
    station.close()


def test_presence_is_seen_coming_and_going(ends: tuple[Bus, Bus]):
    station, console = ends
    token = console.alive("gcs/alive/planner-red")
    seen: queue.Queue[tuple[str, bool]] = queue.Queue()
    station.watch("gcs/alive/*", lambda key, present: seen.put((key, present)))
    assert seen.get(timeout=5) == ("gcs/alive/planner-red", True)
    token.close()
    assert seen.get(timeout=5) == ("gcs/alive/planner-red", False)


def test_connecting_to_no_station_is_one_clear_error(tmp_path: Path):
    with pytest.raises(BusError, match="cannot connect"):
        connect(tmp_path / "nothing")


@pytest.mark.parametrize(
    ("pattern", "key", "expected"),
    [("a/*/c", "a/b/c", True), ("a/*", "a/b/c", False), ("a/b", "a/b", True), ("a/*/c", "a//c", True)],
)
def test_matching(pattern: str, key: str, expected: bool):
    assert matches(pattern, key) is expected
