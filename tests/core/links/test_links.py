"""Errors of opening are one line each; the link in memory; what holds for every kind of link."""

import inspect
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.core.rigs.link_rig import FRAME, free_port
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.links import LinkError, LinkSpec, open_link, parse_link
from tui_gcs.core.links.base import MAX_DATAGRAMS_PER_RECEIVE, Link
from tui_gcs.core.links.memory import MemoryLink


@pytest.mark.parametrize("scheme", ["udpin", "tcpin"])
def test_a_busy_port_is_one_clear_line(scheme: str) -> None:
    kind = socket.SOCK_DGRAM if scheme == "udpin" else socket.SOCK_STREAM
    first = open_link(f"{scheme}:127.0.0.1:{free_port(kind)},network=a")
    with pytest.raises(LinkError) as caught:
        open_link(f"{first.name},network=b")
    assert str(caught.value) == (
        f"{first.name}: port {first.spec.port} is busy: another ground station or simulator uses it. "
        "Close it or take another port"
    )
    first.close()
    open_link(first.name).close()


@pytest.mark.process
@pytest.mark.parametrize("scheme", ["udpin", "tcpin"])
def test_a_second_process_cannot_take_the_port(scheme: str) -> None:
    kind = socket.SOCK_DGRAM if scheme == "udpin" else socket.SOCK_STREAM
    link = open_link(f"{scheme}:127.0.0.1:{free_port(kind)}")
    program = f"from tui_gcs.core.links import open_link; open_link({link.name!r})"
    other = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert other.returncode != 0
    assert f"port {link.spec.port} is busy" in other.stderr
    link.close()


@pytest.mark.parametrize("scheme", ["udpin", "tcpin"])
def test_a_program_that_would_share_the_port_cannot(scheme: str) -> None:
    kind = socket.SOCK_DGRAM if scheme == "udpin" else socket.SOCK_STREAM
    link = open_link(f"{scheme}:127.0.0.1:{free_port(kind)}")
    with socket.socket(socket.AF_INET, kind) as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with pytest.raises(OSError):
            other.bind(("127.0.0.1", link.spec.port))
            other.listen()
    link.close()


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("udpin:192.0.2.1:14550", "not an address of this machine. Use 0.0.0.0 or 127.0.0.1"),
        ("tcpin:192.0.2.1:5760", "not an address of this machine"),
        ("udpout:no.such.host.invalid:14550", "unknown host 'no.such.host.invalid'"),
        ("replay:/no/such/file.tlog", "cannot be read"),
    ],
)
def test_what_cannot_be_opened_says_why(name: str, why: str) -> None:
    with pytest.raises(LinkError) as caught:
        open_link(name)
    assert why in str(caught.value)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_link_knows_what_the_operator_asked_for() -> None:
    text = f"udpin:127.0.0.1:{free_port()},network=north,rate=5000"
    link = open_link(text)
    assert link.spec == parse_link(text)
    assert (link.name, link.error) == (link.spec.name, "")
    link.close()


@pytest.fixture(params=["udpin", "udpout", "tcp", "tcpin", "serial", "memory"])
def link(request: pytest.FixtureRequest) -> Link:
    """One link of every kind, with nobody at the other end."""
    if request.param == "memory":
        return MemoryLink()
    if request.param == "serial":
        return open_link("serial:/dev/no-such-device", VirtualClock())
    kind = socket.SOCK_STREAM if "tcp" in request.param else socket.SOCK_DGRAM
    return open_link(f"{request.param}:127.0.0.1:{free_port(kind)}", VirtualClock())


def test_every_link_has_the_whole_interface(link: Link) -> None:
    members = {name for name, _ in inspect.getmembers(Link) if not name.startswith("_")}
    assert members
    assert all(hasattr(link, name) for name in members)
    assert (link.bytes_in, link.bytes_out, link.send_refused, link.kernel_drops) == (0, 0, 0, 0)
    link.close()


def open_descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="only Linux tells which descriptors are open")
def test_a_closed_link_is_silent_and_keeps_no_descriptor(link: Link) -> None:
    before = open_descriptors()
    held = len(link.filenos())
    link.close()
    link.close()
    assert link.filenos() == []
    assert link.receive() == []
    link.send(FRAME, ("127.0.0.1", 14550))
    assert link.receive() == []
    assert open_descriptors() == before - held
    assert isinstance(link, MemoryLink) or (link.send_refused, link.bytes_out) == (1, 0)


def test_partners_are_those_we_speak_to_first() -> None:
    listening = open_link(f"udpin:127.0.0.1:{free_port()}")
    calling = open_link(f"udpout:localhost:{listening.spec.port}")
    assert listening.partners == []
    assert calling.partners == [("127.0.0.1", listening.spec.port)]
    assert open_link("tcp:127.0.0.1:5760").partners == [("127.0.0.1", 5760)]
    assert open_link("serial:/dev/ttyUSB0").partners == ["/dev/ttyUSB0"]
    listening.close()
    calling.close()


def test_memory_link_hands_over_in_order_and_bounded() -> None:
    link = MemoryLink()
    for number in range(MAX_DATAGRAMS_PER_RECEIVE + 1):
        link.inject(str(number).encode(), "vehicle 1")
    assert len(link.receive()) == MAX_DATAGRAMS_PER_RECEIVE
    assert link.receive() == [(str(MAX_DATAGRAMS_PER_RECEIVE).encode(), "vehicle 1")]
    link.send(b"to you", "vehicle 1")
    assert list(link.sent) == [(b"to you", "vehicle 1")]
    assert (link.bytes_in, link.bytes_out) == (sum(len(str(n)) for n in range(MAX_DATAGRAMS_PER_RECEIVE + 1)), 6)


def test_memory_links_can_play_any_kind_of_link() -> None:
    slow = MemoryLink(spec=LinkSpec("radio", "memory", "", network="north", bytes_per_s=4032), stream=True)
    assert (slow.name, slow.stream, slow.spec.network) == ("radio", True, "north")
