"""What the tests of links share: frames, free ports, waiting for the kernel."""

import socket
import time
from collections.abc import Callable
from typing import TypeVar

from tui_gcs.core.links.base import Link
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.sources import Address

T = TypeVar("T")
LIMIT_S = 5.0
FRAME = Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=1, time_boot_ms=2)


def free_port(kind: socket.SocketKind = socket.SOCK_DGRAM, host: str = "127.0.0.1") -> int:
    """A port of this machine that nobody uses just now."""
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, kind) as probe:
        probe.bind((host, 0))
        port: int = probe.getsockname()[1]
        return port


def until(attempt: Callable[[], T]) -> T:
    """The first true result of `attempt`; the last one when time is up."""
    deadline = time.monotonic() + LIMIT_S
    while not (result := attempt()) and time.monotonic() < deadline:
        time.sleep(0.002)
    return result


def arrives(link: Link) -> list[tuple[bytes, Address]]:
    """What arrives next: the kernel delivers loopback at once, but not in zero time."""
    return until(link.receive)


def stream_of(link: Link, size: int) -> bytes:
    """The next `size` bytes of a stream link with one partner."""
    got = b""

    def enough() -> bool:
        nonlocal got
        got += b"".join(data for data, _ in link.receive())
        return len(got) >= size

    until(enough)
    return got


def taken(connection: socket.socket, size: int) -> bytes:
    """The next `size` bytes that a plain socket hears."""
    connection.settimeout(LIMIT_S)
    got = b""
    while len(got) < size and (data := connection.recv(65536)):
        got += data
    return got
