"""UDP links: which senders are heard and answered, and what is reported when datagrams do not arrive."""

import errno
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.link_rig import FRAME, arrives, free_port, until
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.links import open_link, parse_link
from tui_gcs.core.links import udp as udp_module
from tui_gcs.core.links.base import Link
from tui_gcs.core.links.resolve import resolve
from tui_gcs.core.links.udp import RECEIVE_BUFFER_BYTES, RENEW_GAP_S, TROUBLE_S, UdpInLink, UdpOutLink

RMEM_MAX = Path("/proc/sys/net/core/rmem_max")
REFUSED = "nothing listens there (connection refused)"
linux = pytest.mark.skipif(not RMEM_MAX.exists(), reason="only Linux tells what it drops and grants")


@pytest.fixture
def udpin() -> Iterator[Link]:
    link = open_link(f"udpin:127.0.0.1:{free_port()}")
    yield link
    link.close()


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


def udpout(port: int, clock: VirtualClock) -> UdpOutLink:
    spec = parse_link(f"udpout:127.0.0.1:{port}")
    return UdpOutLink(spec, resolve(spec), clock)


def test_a_vehicle_is_answered_where_it_spoke_from(udpin: Link, clock: VirtualClock) -> None:
    vehicle = udpout(udpin.spec.port, clock)
    vehicle.send(b"hello", "ignored")
    ((data, address),) = arrives(udpin)
    assert data == b"hello"
    udpin.send(b"answer", address)
    assert arrives(vehicle) == [(b"answer", ("127.0.0.1", udpin.spec.port))]
    assert udpin.error == vehicle.error == ""
    assert (udpin.bytes_in, udpin.bytes_out, vehicle.bytes_in, vehicle.bytes_out) == (5, 6, 6, 5)
    vehicle.close()


@pytest.mark.skipif(not socket.has_ipv6, reason="no IPv6 here")
def test_ipv6_is_answered_where_it_spoke_from(clock: VirtualClock) -> None:
    try:
        port = free_port(host="::1")
    except OSError:
        pytest.skip("no IPv6 loopback here")
    station, vehicle = open_link(f"udpin:[::1]:{port}"), open_link(f"udpout:[::1]:{port}", clock)
    ipv4 = open_link(f"udpin:127.0.0.1:{port}")  # another link, and no conflict
    vehicle.send(b"hello", "")
    ((data, address),) = arrives(station)
    station.send(data + b" you", address)
    assert [data for data, _ in arrives(vehicle)] == [b"hello you"]
    for link in (station, vehicle, ipv4):
        link.close()


def test_receive_gives_nothing_when_nothing_is_there(udpin: Link) -> None:
    assert udpin.receive() == []
    assert len(udpin.filenos()) == 1


def test_one_receive_is_bounded(udpin: Link, clock: VirtualClock, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(udp_module, "MAX_DATAGRAMS_PER_RECEIVE", 10)
    vehicle = udpout(udpin.spec.port, clock)
    for number in range(25):
        vehicle.send(bytes([number]), "")
    got = [arrives(udpin) for _ in range(3)]
    assert [len(datagrams) for datagrams in got] == [10, 10, 5]
    assert [data[0] for datagrams in got for data, _ in datagrams] == list(range(25))
    vehicle.close()


@linux
def test_the_granted_receive_buffer_is_told(udpin: Link) -> None:
    assert isinstance(udpin, UdpInLink)
    granted = udpin._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    assert granted // 2 == min(RECEIVE_BUFFER_BYTES, int(RMEM_MAX.read_text()))  # Linux returns twice the size


@linux
def test_what_the_system_drops_is_counted(clock: VirtualClock, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(udp_module, "RECEIVE_BUFFER_BYTES", 8192)
    station = open_link(f"udpin:127.0.0.1:{free_port()}")
    vehicle = udpout(station.spec.port, clock)
    assert station.kernel_drops == 0
    for _ in range(200):
        vehicle.send(bytes(1000), "")
    until(lambda: station.kernel_drops)
    heard = len(station.receive())
    assert heard > 0
    assert station.kernel_drops == 200 - heard > 0
    dropped = station.kernel_drops
    station.close()
    assert station.kernel_drops == dropped
    vehicle.close()


def test_udpout_hears_only_its_partner(udpin: Link, clock: VirtualClock) -> None:
    link = udpout(udpin.spec.port, clock)
    link.send(b"hello", "")
    ((_, address),) = arrives(udpin)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(b"I am the vehicle", address)
    udpin.send(b"no, I am", address)
    assert arrives(link) == [(b"no, I am", ("127.0.0.1", udpin.spec.port))]
    link.close()


def test_nobody_listening_is_shown_for_as_long_as_it_lasts(clock: VirtualClock) -> None:
    link = udpout(free_port(), clock)
    link.send(FRAME, "")
    assert until(lambda: link.receive() or link.error) == REFUSED
    for _ in range(10):  # a heartbeat each second, each refused: one trouble, not ten
        link.send(FRAME, "")
        link.receive()
        clock.advance(1)
        assert link.error == REFUSED
    link.close()


def test_a_refusal_is_over_when_the_partner_speaks(clock: VirtualClock) -> None:
    port = free_port()
    link = udpout(port, clock)
    link.send(b"first", "")
    until(lambda: link.receive() or link.error)
    link.send(b"second", "")  # leaves an answer "refused" waiting in the socket
    partner = open_link(f"udpin:127.0.0.1:{port}")
    link.send(b"third", "")
    ((data, address),) = arrives(partner)
    assert data == b"third"  # was not eaten by the earlier refusal
    assert link.error == REFUSED
    partner.send(b"here", address)
    assert arrives(link)
    assert link.error == ""
    assert link.send_refused == 0
    link.close()
    partner.close()


def test_a_refusal_is_over_when_it_does_not_come_again(clock: VirtualClock) -> None:
    link = udpout(free_port(), clock)
    link.send(FRAME, "")
    until(lambda: link.receive() or link.error)
    clock.advance(TROUBLE_S - 0.1)
    link.receive()
    assert link.error == REFUSED
    clock.advance(0.1)
    link.receive()
    assert link.error == ""
    link.close()


@pytest.mark.parametrize(
    "to", ["memory", ("127.0.0.1", 70000), ("127.0.0.1", 0), ("::1", 14550, 0, 0), ("255.255.255.255", 14550)]
)
def test_what_cannot_be_sent_is_counted(udpin: Link, to: Any) -> None:
    udpin.send(FRAME, to)
    assert (udpin.send_refused, udpin.bytes_out) == (1, 0)
    assert udpin.error.startswith("cannot send: ")


def test_a_frame_too_large_for_a_datagram_is_counted(udpin: Link, clock: VirtualClock) -> None:
    link = udpout(udpin.spec.port, clock)
    link.send(bytes(70000), "")
    assert (link.send_refused, link.error) == (1, "cannot send: Message too long")
    link.close()


class Deaf:
    """A socket whose address this machine has lost."""

    def __init__(self, real: socket.socket) -> None:
        self.real = real

    def send(self, data: bytes) -> int:
        raise OSError(errno.EINVAL, "Invalid argument")

    def __getattr__(self, name: str) -> Any:
        return getattr(self.real, name)


def test_udpout_works_again_after_the_machine_has_changed_its_network(udpin: Link, clock: VirtualClock) -> None:
    link = udpout(udpin.spec.port, clock)
    link._socket = Deaf(link._socket)  # type: ignore[assignment]
    clock.advance(RENEW_GAP_S)
    link.send(b"lost", "")
    assert (link.send_refused, link.error) == (1, "cannot send: Invalid argument")
    link.send(b"hello", "")
    ((data, address),) = arrives(udpin)
    assert data == b"hello"
    udpin.send(b"answer", address)
    assert arrives(link)
    assert link.error == ""
    link.close()


def test_a_flood_of_strangers_costs_no_memory(clock: VirtualClock) -> None:
    spec = parse_link(f"udpin:127.0.0.1:{free_port()}")
    link = UdpInLink(spec, resolve(spec), clock)
    state = {name: value for name, value in vars(link).items() if name != "bytes_in"}
    for _ in range(50):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.sendto(b"\xfd\xff\x01", ("127.0.0.1", spec.port))
        assert arrives(link)
    assert {name: value for name, value in vars(link).items() if name != "bytes_in"} == state
    assert link.bytes_in == 150
    link.close()
