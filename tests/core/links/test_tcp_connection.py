"""The TCP client link: raw chunks of a stream that says when it starts, bounded sending, retries on the clock."""

import errno
import socket
from collections.abc import Iterator
from contextlib import suppress

import pytest

from tests.core.rigs.link_rig import FRAME, free_port, stream_of, taken, until
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.links import open_link
from tui_gcs.core.links.base import Link
from tui_gcs.core.links.reconnect_timer import MAX_RETRY_S
from tui_gcs.core.links.send_queue import STALL_TIMEOUT_S
from tui_gcs.core.links.tcp_connection import MAX_UNSENT_BYTES


class Server:
    """A TCP server for one client at a time."""

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.settimeout(5)
        self.address: tuple[str, int] = self.listener.getsockname()

    def accept(self) -> socket.socket:
        connection, _ = self.listener.accept()
        connection.settimeout(5)
        return connection


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server()
    yield server
    server.listener.close()


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture
def link(server: Server, clock: VirtualClock) -> Iterator[Link]:
    link = open_link(f"tcp:127.0.0.1:{server.address[1]}", clock)
    yield link
    link.close()


def connect(link: Link, server: Server) -> socket.socket:
    """The server's end of the connection, whose start the link has told."""
    assert until(link.receive) == [(b"", server.address)]
    assert link.error == ""
    return server.accept()


def test_a_stream_says_that_it_starts_and_then_comes_as_it_is(link: Link, server: Server) -> None:
    assert link.stream
    connection = connect(link, server)
    connection.sendall(FRAME[:7])
    assert until(link.receive) == [(FRAME[:7], server.address)]
    connection.sendall(FRAME[7:] + FRAME)
    assert stream_of(link, 2 * len(FRAME) - 7) == FRAME[7:] + FRAME
    link.send(FRAME, "whoever")
    assert taken(connection, len(FRAME)) == FRAME
    assert (link.bytes_in, link.bytes_out) == (2 * len(FRAME), len(FRAME))
    assert len(link.filenos()) == 1
    connection.close()


def test_it_comes_back_by_itself_when_the_clock_says_so(link: Link, server: Server, clock: VirtualClock) -> None:
    connection = connect(link, server)
    connection.sendall(FRAME[:9])
    assert stream_of(link, 9) == FRAME[:9]
    connection.close()
    until(lambda: link.receive() or link.error)
    assert link.error == "closed by the other side; next try in 1 s"
    assert link.filenos() == []
    link.send(FRAME, "")
    assert link.send_refused == 1
    clock.advance(0.9)
    link.receive()
    assert "next try" in link.error
    clock.advance(0.2)
    connection = connect(link, server)  # whose start says that the nine bytes are worth nothing now
    connection.sendall(FRAME)
    assert stream_of(link, len(FRAME)) == FRAME
    connection.close()


def test_it_tries_less_and_less_often(clock: VirtualClock) -> None:
    link = open_link(f"tcp:127.0.0.1:{free_port(socket.SOCK_STREAM)}", clock)
    assert link.error == "not connected yet"
    errors = []
    for _ in range(6):
        before = link.error
        until(lambda before=before: link.receive() or link.error != before or len(errors) > 4)
        errors.append(link.error)
        clock.advance(MAX_RETRY_S)
    assert errors == [f"Connection refused; next try in {wait_s} s" for wait_s in (1, 2, 4, 8, 10, 10)]
    link.close()


def test_a_partner_that_speaks_is_called_again_soon(link: Link, server: Server, clock: VirtualClock) -> None:
    for _ in range(3):  # each time the partner says something: never more than the shortest wait
        connection = connect(link, server)
        connection.sendall(FRAME)
        stream_of(link, len(FRAME))
        connection.close()
        until(lambda: link.receive() or link.error)
        assert link.error.endswith("next try in 1 s")
        clock.advance(1)


def test_a_partner_that_only_hangs_up_is_called_less_often(link: Link, server: Server, clock: VirtualClock) -> None:
    waits = []
    for _ in range(3):
        connect(link, server).close()
        until(lambda: link.receive() or link.error)
        waits.append(link.error.rpartition(" in ")[2])
        clock.advance(MAX_RETRY_S)
    assert waits == ["1 s", "2 s", "4 s"]


def test_a_partner_that_does_not_answer_is_given_up(clock: VirtualClock) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as full:
        full.bind(("127.0.0.1", 0))
        full.listen(0)
        waiting = [socket.socket(socket.AF_INET, socket.SOCK_STREAM) for _ in range(4)]
        for one in waiting:  # the queue of the server that never accepts is full now
            one.setblocking(False)
            assert one.connect_ex(full.getsockname()) in (0, errno.EINPROGRESS)
        link = open_link(f"tcp:127.0.0.1:{full.getsockname()[1]}", clock)
        link.receive()
        clock.advance(4.9)
        assert link.receive() == []
        assert link.error == "not connected yet"
        clock.advance(0.1)
        link.receive()
        assert link.error == "no answer; next try in 1 s"
        link.close()
        for one in waiting:
            one.close()


def numbered(number: int) -> bytes:
    return number.to_bytes(4, "big") + bytes(252)


def test_a_partner_that_does_not_read_gets_whole_frames_and_no_endless_queue(link: Link, server: Server) -> None:
    connection = connect(link, server)
    sent = 0
    while not link.send_refused:
        link.send(numbered(sent), "")
        sent += 1
    waiting = 256 * (sent - 1) - link.bytes_out
    assert MAX_UNSENT_BYTES - 256 < waiting <= MAX_UNSENT_BYTES
    connection.settimeout(0.05)
    heard = b""

    def all_heard() -> bool:
        nonlocal heard
        with suppress(TimeoutError):
            heard += connection.recv(1 << 20)
        link.receive()  # sends what waits
        return len(heard) == 256 * (sent - 1)

    assert until(all_heard)
    assert heard == b"".join(map(numbered, range(sent - 1)))
    assert (link.bytes_out, link.send_refused, link.error) == (len(heard), 1, "")
    connection.close()


def test_a_partner_that_takes_nothing_any_more_is_given_up(link: Link, server: Server, clock: VirtualClock) -> None:
    connection = connect(link, server)
    sent = 0
    while not link.send_refused:
        link.send(numbered(sent), "")
        sent += 1
    clock.advance(STALL_TIMEOUT_S - 0.1)
    link.receive()
    assert link.error == ""
    clock.advance(0.1)
    link.receive()
    assert link.error == "takes nothing any more; next try in 1 s"
    out, refused = link.bytes_out, link.send_refused
    assert refused == sent - out // 256  # each frame has left or is counted; the one cut in the middle as refused
    clock.advance(1)
    with connect(link, server) as again:
        link.send(FRAME, "")
        assert taken(again, len(FRAME)) == FRAME  # and not the rest of a frame of the old connection
    connection.close()


def test_one_receive_is_bounded(link: Link, server: Server) -> None:
    connection = connect(link, server)
    connection.settimeout(0.05)
    with suppress(TimeoutError):
        while True:
            connection.sendall(bytes(65536))
    assert sum(len(data) for data, _ in link.receive()) == 16384
    connection.close()
