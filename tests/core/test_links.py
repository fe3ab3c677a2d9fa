"""Links never block and never raise once open; opening says in one line what is wrong."""

import socket
import time
from collections.abc import Callable, Iterator
from typing import TypeVar

import pytest

from tui_gcs.core.clock import VirtualClock
from tui_gcs.core.links import Address, LinkError, open_link
from tui_gcs.core.links.base import MAX_DATAGRAMS_PER_RECEIVE, Link
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.links.tcp import LAST_RETRY_S, TcpLink
from tui_gcs.core.wire.encode import Encoder

T = TypeVar("T")
FRAME = Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=1, time_boot_ms=2)


def free_port(kind: socket.SocketKind = socket.SOCK_DGRAM) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def wait_for(link: Link) -> list[tuple[bytes, Address]]:
    """What arrives within two seconds: the kernel delivers loopback at once, but not in zero time."""
    return until(link.receive)


def until(attempt: Callable[[], T]) -> T:
    """The first true result of `attempt` within two seconds."""
    deadline = time.monotonic() + 2
    while not (result := attempt()) and time.monotonic() < deadline:
        pass
    return result


@pytest.fixture
def udpin() -> Iterator[Link]:
    link = open_link(f"udpin:127.0.0.1:{free_port()}")
    yield link
    link.close()


def port_of(link: Link) -> int:
    return int(link.name.rpartition(":")[2])


def test_a_vehicle_is_answered_where_it_spoke_from(udpin: Link) -> None:
    vehicle = open_link(f"udpout:127.0.0.1:{port_of(udpin)}")
    vehicle.send(b"hello", "ignored")
    ((data, address),) = wait_for(udpin)
    assert data == b"hello"
    udpin.send(b"answer", address)
    assert wait_for(vehicle) == [(b"answer", ("127.0.0.1", port_of(udpin)))]
    assert udpin.error == vehicle.error == ""
    vehicle.close()


def test_receive_gives_nothing_when_nothing_is_there(udpin: Link) -> None:
    assert udpin.receive() == []
    assert isinstance(udpin.fileno(), int)


def test_a_busy_port_is_one_clear_line(udpin: Link) -> None:
    with pytest.raises(LinkError) as caught:
        open_link(udpin.name)
    assert str(caught.value) == (
        f"{udpin.name}: port {port_of(udpin)} is busy: another ground station or simulator uses it. "
        "Close it or take another port"
    )


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("", "unknown kind"),
        ("com3", "unknown kind 'com3'; allowed: udpin:HOST:PORT"),
        ("udpin:14550", "not HOST:PORT"),
        ("udpin:127.0.0.1:", "not HOST:PORT"),
        ("udpin:127.0.0.1:http", "not HOST:PORT"),
        ("udpin:127.0.0.1:0", "not within 1…65535"),
        ("tcp:127.0.0.1:70000", "not within 1…65535"),
        ("udpin:192.0.2.1:14550", "not an address of this machine"),
        ("udpin:" + "x" * 300 + ":14550", "unknown host"),
    ],
)
def test_what_cannot_be_opened_says_why(name: str, why: str) -> None:
    with pytest.raises(LinkError) as caught:
        open_link(name)
    assert why in str(caught.value)
    assert "\n" not in str(caught.value)


def test_nobody_listening_is_an_error_text_not_an_exception() -> None:
    link = open_link(f"udpout:127.0.0.1:{free_port()}")
    link.send(b"x", "")
    assert until(lambda: link.receive() or link.error) == "Connection refused"
    link.close()
    link.send(b"x", "")
    assert link.receive() == []
    assert link.fileno() is None


def test_memory_link_hands_over_in_order_and_bounded() -> None:
    link = MemoryLink()
    for number in range(MAX_DATAGRAMS_PER_RECEIVE + 1):
        link.inject(str(number).encode(), "vehicle 1")
    assert len(link.receive()) == MAX_DATAGRAMS_PER_RECEIVE
    assert link.receive() == [(str(MAX_DATAGRAMS_PER_RECEIVE).encode(), "vehicle 1")]
    link.send(b"to you", "vehicle 1")
    assert list(link.sent) == [(b"to you", "vehicle 1")]
    assert link.fileno() is None


class Server:
    """A TCP server for one client."""

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.settimeout(2)
        self.port: int = self.listener.getsockname()[1]

    def accept(self) -> socket.socket:
        connection, _ = self.listener.accept()
        connection.settimeout(2)
        return connection


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server()
    yield server
    server.listener.close()


def connected(server: Server, clock: VirtualClock) -> tuple[TcpLink, socket.socket]:
    link = TcpLink(f"tcp:127.0.0.1:{server.port}", ("127.0.0.1", server.port), clock)
    link.receive()
    connection = server.accept()
    until(lambda: link.receive() == [] and not link.error)
    return link, connection


def test_tcp_gives_whole_frames_however_the_stream_is_split(server: Server) -> None:
    link, connection = connected(server, VirtualClock())
    connection.sendall(FRAME[:7])
    assert link.receive() == []
    connection.sendall(FRAME[7:] + FRAME)
    frames = wait_for(link)
    while len(frames) < 2:
        frames += wait_for(link)
    assert frames == [(FRAME, ("127.0.0.1", server.port))] * 2
    link.send(FRAME, "")
    assert connection.recv(100) == FRAME
    link.close()
    connection.close()


def test_tcp_comes_back_by_itself_when_the_clock_says_so(server: Server) -> None:
    clock = VirtualClock()
    link, connection = connected(server, clock)
    connection.close()
    until(lambda: link.receive() or link.error)
    assert link.error == "closed by the other side; next try in 1 s"
    assert link.fileno() is None
    clock.advance(0.9)
    link.receive()
    assert "next try" in link.error
    clock.advance(0.2)
    link.receive()
    connection = server.accept()
    until(lambda: link.receive() == [] and not link.error)
    connection.sendall(FRAME)
    assert [data for data, _ in wait_for(link)] == [FRAME]
    link.close()
    connection.close()


def test_tcp_tries_less_and_less_often() -> None:
    clock = VirtualClock()
    port = free_port(socket.SOCK_STREAM)
    link = open_link(f"tcp:127.0.0.1:{port}", clock)
    waits = []
    for _ in range(6):
        link.receive()
        until(lambda: link.receive() or "next try" in link.error)
        waits.append(link.error.rpartition("next try in ")[2])
        clock.advance(LAST_RETRY_S)
        link.error = ""
    assert waits == ["1 s", "2 s", "4 s", "8 s", "10 s", "10 s"]
    link.send(FRAME, "")  # not connected: dropped, no exception
    link.close()
