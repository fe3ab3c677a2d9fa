"""The TCP link that listens: every client its own address and stream; none harms the others."""

import errno
import os
import socket
from collections.abc import Callable, Iterator
from contextlib import suppress

import pytest

from tests.core.rigs.link_rig import FRAME, LIMIT_S, free_port, taken, until
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.links import open_link, parse_link
from tui_gcs.core.links.base import MAX_BYTES_PER_RECEIVE
from tui_gcs.core.links.resolve import resolve
from tui_gcs.core.links.send_queue import STALL_TIMEOUT_S
from tui_gcs.core.links.tcp_server import MAX_CLIENTS, PAUSE_S, SILENT_S, TcpInLink
from tui_gcs.core.mavlink.sources import Address


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture
def link(clock: VirtualClock) -> Iterator[TcpInLink]:
    spec = parse_link(f"tcpin:127.0.0.1:{free_port(socket.SOCK_STREAM)}")
    link = TcpInLink(spec, resolve(spec), clock)
    yield link
    link.close()


@pytest.fixture
def client(link: TcpInLink) -> Iterator[Callable[[], socket.socket]]:
    """Makes clients whose start the link has told."""
    made: list[socket.socket] = []

    def make() -> socket.socket:
        one = socket.create_connection(("127.0.0.1", link.spec.port), timeout=LIMIT_S)
        made.append(one)
        assert until(link.receive) == [(b"", one.getsockname())]
        return one

    yield make
    for one in made:
        one.close()


MakeClient = Callable[[], socket.socket]


def hears(link: TcpInLink, client: socket.socket) -> bool:
    """Whether the link hears what this client says now."""
    client.sendall(FRAME)
    return until(link.receive) == [(FRAME, client.getsockname())]


def is_closed(client: socket.socket) -> bool:
    client.settimeout(LIMIT_S)
    try:
        return client.recv(1) == b""
    except ConnectionResetError:
        return True


def test_each_client_has_its_own_address_and_is_answered_there(link: TcpInLink, client: MakeClient) -> None:
    assert (link.stream, link.error, link.partners) == (True, "", [])
    first, second = client(), client()
    second.sendall(b"second")
    assert until(link.receive) == [(b"second", second.getsockname())]
    first.sendall(b"first")
    assert until(link.receive) == [(b"first", first.getsockname())]
    link.send(b"to the first", first.getsockname())
    link.send(b"to the second", second.getsockname())
    assert taken(first, 12) == b"to the first"
    assert taken(second, 13) == b"to the second"
    assert (link.bytes_in, link.bytes_out) == (11, 25)
    assert len(set(link.filenos())) == 3


def test_a_client_that_has_gone_is_forgotten(link: TcpInLink, client: MakeClient) -> None:
    stays, goes = client(), client()
    address: Address = goes.getsockname()
    goes.close()
    until(lambda: link.receive() or len(link.filenos()) == 2)
    link.send(FRAME, address)
    assert (link.send_refused, link.bytes_out, link.error) == (1, 0, "")
    assert hears(link, stays)


def test_the_seventeenth_client_is_turned_away(link: TcpInLink, client: MakeClient) -> None:
    clients = [client() for _ in range(MAX_CLIENTS)]
    assert len(clients) == 16
    with socket.create_connection(("127.0.0.1", link.spec.port), timeout=LIMIT_S) as late:
        until(lambda: link.receive() or link.refused_clients)
        assert is_closed(late)
    assert link.refused_clients == 1
    assert all(hears(link, one) for one in clients)
    clients[3].close()
    until(lambda: link.receive() or len(link.filenos()) == MAX_CLIENTS)
    assert hears(link, client())


def test_clients_that_say_nothing_do_not_keep_others_out(
    link: TcpInLink, client: MakeClient, clock: VirtualClock
) -> None:
    clients = [client() for _ in range(MAX_CLIENTS)]
    clock.advance(SILENT_S)
    assert all(hears(link, one) for one in clients[1:])
    new = client()
    assert hears(link, new)
    assert is_closed(clients[0])
    assert link.refused_clients == 0


def test_a_client_that_does_not_read_is_dropped_alone(link: TcpInLink, client: MakeClient, clock: VirtualClock) -> None:
    good, bad = client(), client()
    while not link.send_refused:
        link.send(bytes(1024), bad.getsockname())
    link.send(FRAME, good.getsockname())
    assert taken(good, len(FRAME)) == FRAME
    clock.advance(STALL_TIMEOUT_S)
    link.receive()
    assert len(link.filenos()) == 2
    assert hears(link, good)


def test_where_no_descriptor_is_left_the_listener_does_not_keep_us_busy(
    link: TcpInLink, clock: VirtualClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Full:
        """The listener of a process that may open nothing more: it stays readable."""

        def __init__(self, listener: socket.socket) -> None:
            self.fileno, self.close = listener.fileno, listener.close

        def accept(self) -> None:
            raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    listener = link._listener
    with socket.create_connection(("127.0.0.1", link.spec.port), timeout=LIMIT_S) as waits:
        monkeypatch.setattr(link, "_listener", Full(listener))
        assert link.receive() == []
        assert "open files" in link.error
        assert link.filenos() == [], "select does not wake up for it"
        monkeypatch.setattr(link, "_listener", listener)
        clock.advance(PAUSE_S)
        assert len(link.filenos()) == 1
        assert until(link.receive) == [(b"", waits.getsockname())]
        assert link.error == ""


def test_many_clients_that_flood_are_read_in_turn(link: TcpInLink, client: MakeClient) -> None:
    flooders = [client() for _ in range(5)]
    for flooder in flooders:
        flooder.settimeout(0.05)
        with suppress(TimeoutError):
            while True:
                flooder.sendall(bytes(65536))
    looks = [link.receive() for _ in range(3)]
    assert all(sum(len(data) for data, _ in look) <= MAX_BYTES_PER_RECEIVE for look in looks)
    assert {address for look in looks for _, address in look} == {one.getsockname() for one in flooders}


def test_a_client_that_floods_leaves_the_others_their_share(link: TcpInLink, client: MakeClient) -> None:
    flooder, good = client(), client()
    flooder.settimeout(0.05)
    with suppress(TimeoutError):
        while True:
            flooder.sendall(bytes(65536))
    good.sendall(FRAME)
    chunks = until(lambda: [chunk for chunk in [link.receive()] if any(data == FRAME for data, _ in chunk)])[0]
    assert {address for _, address in chunks} == {flooder.getsockname(), good.getsockname()}
    assert sum(len(data) for data, _ in chunks) <= 2 * 16384


def test_a_station_that_starts_again_can_listen_at_once(link: TcpInLink, client: MakeClient) -> None:
    client()  # its connection lingers in the system after the close
    link.close()
    again = open_link(link.name)
    assert again.error == ""
    again.close()


def test_a_hundred_flaps_leave_no_descriptor_behind(link: TcpInLink, client: MakeClient) -> None:
    for _ in range(100):
        client().close()
        until(lambda: link.receive() or len(link.filenos()) == 1)
    assert len(link.filenos()) == 1
