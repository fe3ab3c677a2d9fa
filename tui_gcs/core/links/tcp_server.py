"""TCP server link: simulators, routers and vehicles' companions connect to it, several at once."""

import math
import socket

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.links.base import MAX_BYTES_PER_RECEIVE, Link, reason
from tui_gcs.core.links.resolve import ResolvedAddress, listen_advice
from tui_gcs.core.links.spec import LinkError, LinkSpec
from tui_gcs.core.links.tcp_connection import TcpConnection
from tui_gcs.core.mavlink.sources import Address

# Each client is a socket and a stream with its own state: a scan must not take all descriptors.
MAX_CLIENTS = 16
SILENT_S = 30.0
"""A client that sent nothing for this long makes room for a new one when all places are taken."""
_MAX_BYTES_PER_READ = 16384
"""Taken of one client per `receive`: 430 telemetry frames, so that none starves the others."""
PAUSE_S = 1.0
"""Where the system has no descriptor left the listener stays readable: accepting again at once would be all we do."""


class TcpInLink(Link):
    """A listening TCP socket; each client has its own address and its own stream."""

    stream = True

    def __init__(self, spec: LinkSpec, place: ResolvedAddress, clock: Clock) -> None:
        """Listen on `place`, alone.

        Raises:
            LinkError: the port is busy, or the address is not ours.
        """
        super().__init__(spec)
        self._clock = clock
        self._clients: dict[Address, TcpConnection] = {}
        self._paused_until_s = -math.inf
        self._listener = _listener(spec, place)

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`."""
        chunks: list[tuple[bytes, Address]] = [(b"", client.address) for client in self._accept()]
        size = 0
        for client in list(self._clients.values()):
            if size >= MAX_BYTES_PER_RECEIVE:
                break
            data = client.read(_MAX_BYTES_PER_READ)
            del self._clients[client.address]
            if data:
                size += len(data)
                chunks.append((data, client.address))
            if client.error:
                chunks.append((b"", client.address))  # nothing more will come from there
            else:
                # Moved to the end: the next call begins with clients that were not read.
                self._clients[client.address] = client
        return chunks

    def send(self, data: bytes, to: Address) -> None:
        """See `Link.send`; refused where `to` is no longer connected."""
        client = self._clients.get(to)
        if client is None:
            self.send_refused += 1
        else:
            client.send(data)

    def filenos(self) -> list[int]:
        """See `Link.filenos`."""
        numbers = [client.fileno() for client in self._clients.values()]
        if not self._paused:
            numbers.append(self._listener.fileno())
        return [number for number in numbers if number >= 0]

    def close(self) -> None:
        """See `Link.close`."""
        self.error = "closed"
        self._listener.close()
        for client in self._clients.values():
            client.close(self.error)
        self._clients.clear()

    @property
    def _paused(self) -> bool:
        return self._clock.now() < self._paused_until_s

    def _accept(self) -> list[TcpConnection]:
        """Return the clients that are new; at most as many as there are places."""
        new: list[TcpConnection] = []
        if self._paused:
            return new
        for _ in range(MAX_CLIENTS):
            try:
                tcp, address = self._listener.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                break
            except OSError as error:
                self.error = reason(error)
                # No descriptor is left; or the listener is closed.
                self._paused_until_s = self._clock.now() + PAUSE_S
                return new
            if not self._has_room():
                self.refused_clients += 1
                tcp.close()
                continue
            client = TcpConnection(tcp, address, self, self._clock)
            self._clients[address] = client
            new.append(client)
        if self._listener.fileno() >= 0:
            self.error = ""
        return new

    def _has_room(self) -> bool:
        """Return whether one more client may connect; the one that is silent longest is closed for it."""
        if len(self._clients) < MAX_CLIENTS:
            return True
        quietest = min(self._clients.values(), key=lambda client: client.last_heard_s)
        if self._clock.now() - quietest.last_heard_s < SILENT_S:
            return False
        quietest.close("silent")
        del self._clients[quietest.address]
        return True


def _listener(spec: LinkSpec, place: ResolvedAddress) -> socket.socket:
    """A non-blocking listening socket. Raises `LinkError`."""
    try:
        listener = socket.socket(place.family, socket.SOCK_STREAM)
    except OSError as error:
        raise LinkError(f"{spec.name}: cannot open a socket: {reason(error)}") from None
    try:
        # For TCP this only lets a restarted station listen while old connections linger; never two listen at once.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if place.family == socket.AF_INET6:
            listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        listener.bind(place.address)
        listener.listen(MAX_CLIENTS)
        listener.setblocking(False)
    except OSError as error:
        listener.close()
        raise LinkError(f"{spec.name}: {listen_advice(error, spec)}") from None
    return listener
