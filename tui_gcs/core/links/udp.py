"""UDP links. `udpin` listens on a port of ours (many vehicles), `udpout` talks to one address."""

import errno
import socket

from tui_gcs.core.links.base import MAX_DATAGRAMS_PER_RECEIVE, Address
from tui_gcs.core.links.spec import LinkError

RECEIVE_BUFFER_BYTES = 4 * 1024 * 1024
"""The default holds 256 small datagrams, 37 ms of 250 vehicles. The system may grant less."""
_MAX_DATAGRAM_BYTES = 65535


class UdpLink:
    """One non-blocking UDP socket."""

    def __init__(self, name: str, udp: socket.socket) -> None:
        """Use `udp`, which is bound or connected already."""
        self.name = name
        self.error = ""
        self._socket = udp

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`; drains the socket, bounded."""
        datagrams: list[tuple[bytes, Address]] = []
        receive = self._socket.recvfrom
        try:
            for _ in range(MAX_DATAGRAMS_PER_RECEIVE):
                datagrams.append(receive(_MAX_DATAGRAM_BYTES))
        except BlockingIOError:
            pass
        except OSError as error:  # "connection refused" from an earlier send of udpout, or closed
            self.error = _reason(error)
        if datagrams:
            self.error = ""
        return datagrams

    def send(self, data: bytes, to: Address) -> None:
        """See `Link.send`."""
        try:
            self._socket.sendto(data, to)
        except OSError as error:  # full buffer, no route, nobody listening
            self.error = _reason(error)

    def fileno(self) -> int | None:
        """See `Link.fileno`."""
        number = self._socket.fileno()
        return number if number >= 0 else None

    def close(self) -> None:
        """See `Link.close`."""
        self._socket.close()


class UdpOutLink(UdpLink):
    """A socket connected to one partner: hears nobody else, and sends only there."""

    def send(self, data: bytes, to: Address) -> None:
        """Send to the partner, whatever `to` says."""
        try:
            self._socket.send(data)
        except OSError as error:
            self.error = _reason(error)


def open_udpin(name: str, address: tuple[str, int]) -> UdpLink:
    """Listen on `address`, alone: a second program on the port would silently take the first one's vehicles.

    Raises:
        LinkError: the port is busy, or the address is not ours.
    """
    udp = _socket(name)
    try:
        udp.bind(address)  # without SO_REUSEADDR on purpose
    except OSError as error:
        udp.close()
        raise LinkError(f"{name}: {_bind_advice(error, address)}") from None
    return UdpLink(name, udp)


def open_udpout(name: str, address: tuple[str, int]) -> UdpLink:
    """Talk to `address` from a free port of ours. Raises `LinkError` if there is no way there."""
    udp = _socket(name)
    try:
        udp.connect(address)
    except OSError as error:
        udp.close()
        raise LinkError(f"{name}: no way to {address[0]}: {_reason(error)}. Check the address") from None
    return UdpOutLink(name, udp)


def _socket(name: str) -> socket.socket:
    """A non-blocking UDP socket with a big receive buffer."""
    try:
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    except OSError as error:
        raise LinkError(f"{name}: cannot open a socket: {_reason(error)}") from None
    udp.setblocking(False)
    for size in (RECEIVE_BUFFER_BYTES, RECEIVE_BUFFER_BYTES // 4):  # macOS refuses what it cannot grant
        try:
            udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, size)
        except OSError:
            continue
        break
    return udp


def _reason(error: OSError) -> str:
    return error.strerror or str(error)


def _bind_advice(error: OSError, address: tuple[str, int]) -> str:
    """Why binding failed and what to do."""
    if error.errno == errno.EADDRINUSE:
        return f"port {address[1]} is busy: another ground station or simulator uses it. Close it or take another port"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"{address[0]} is not an address of this machine. Use 0.0.0.0 or 127.0.0.1"
    if error.errno == errno.EACCES:
        return f"no permission for port {address[1]}. Take a port above 1023"
    return f"cannot listen on {address[0]}:{address[1]}: {_reason(error)}"
