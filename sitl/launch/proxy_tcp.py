"""The proxy between a station that connects and a vehicle that waits for a TCP connection, as ArduPilot does.

The bytes that are read at once are one datagram to the faults. A lost one is missing in the stream, as with a radio
behind a serial-to-network bridge. Such a radio neither doubles nor reorders, so these faults are refused.
"""

import socket
from contextlib import suppress
from selectors import EVENT_READ, DefaultSelector

from sitl.launch.process import LaunchError, why
from sitl.links.faults import FaultCounter, FaultyLink, Lane, LinkFaults

Address = tuple[str, int]

CONNECT_S = 2.0
CHUNK_BYTES = 4096
MAX_WAITING_BYTES = 1 << 16
"""A side that does not read keeps the other from sending more than this."""


class _TcpLane:
    """One direction: read from one socket, through the faults, written to the other."""

    def __init__(self, source: socket.socket, sink: socket.socket, lane: Lane) -> None:
        self._source, self._sink, self.lane = source, sink, lane
        self._out = bytearray()

    def pump(self, now_s: float) -> bool:
        """Move the bytes that can be moved; False once a side is gone."""
        data = None
        if len(self._out) < MAX_WAITING_BYTES:
            with suppress(BlockingIOError):
                data = self._source.recv(CHUNK_BYTES)
                if not data:
                    return False
        for datagram in self.lane.step(now_s, data):
            self._out += datagram
        if self._out:
            with suppress(BlockingIOError):
                del self._out[: self._sink.send(self._out)]
        return True


class _TcpConnection:
    """The connection of a station, and the one to the vehicle that was made for it."""

    def __init__(self, station: socket.socket, vehicle: socket.socket, link: FaultyLink) -> None:
        self.sockets = (station, vehicle)
        self._ways = (_TcpLane(vehicle, station, link.down), _TcpLane(station, vehicle, link.up))
        for sock in self.sockets:
            sock.setblocking(False)

    def pump(self, now_s: float) -> bool:
        """Move the bytes of both directions; False once a side is gone."""
        try:
            down, up = self._ways
            return down.pump(now_s) and up.pump(now_s)
        except OSError:
            return False

    @property
    def due_s(self) -> float:
        """When the next datagram is due."""
        return min(way.lane.due_s for way in self._ways)


class TcpProxy:
    """Connects one station at a time with one vehicle."""

    def __init__(self, listen: Address, to: Address, faults: LinkFaults, seed: int) -> None:
        """Bind `listen`. Raises `LaunchError` if that is impossible, or a stream cannot have such faults."""
        if any(lane.dup or lane.reorder for lane in (faults.up, faults.down)):
            raise LaunchError("--fault: dup and reorder are for datagrams: leave them out with --tcp")
        self.selector = DefaultSelector()
        self._to = to
        self._link = FaultyLink(faults, seed=seed, vehicle=0)
        self._pair: _TcpConnection | None = None
        try:
            self._server = socket.create_server(listen, backlog=1)
        except (OSError, UnicodeError) as error:
            raise LaunchError(f"--listen {listen[0]}:{listen[1]}: {why(error)}") from None
        self._server.setblocking(False)
        self.selector.register(self._server, EVENT_READ, None)

    def pump(self, now_s: float) -> float:
        """Move the bytes that are due, as `Proxy.pump`."""
        with suppress(OSError):
            station, _ = self._server.accept()
            self._accept(station)
        if self._pair is None:
            return float("inf")
        if not self._pair.pump(now_s):
            self._disconnect()
            return float("inf")
        return self._pair.due_s

    @property
    def address(self) -> Address:
        """The address at which it listens."""
        address: Address = self._server.getsockname()
        return address

    def counts(self) -> tuple[FaultCounter, FaultCounter]:
        """Return the counts, as `Proxy.counts`."""
        return self._link.down.tally, self._link.up.tally

    def close(self) -> None:
        """Close all sockets, as `Proxy.close`."""
        self._disconnect()
        self._server.close()
        self.selector.close()

    def _accept(self, station: socket.socket) -> None:
        """Connect to the vehicle for this station; a second station, or one without a vehicle, is disconnected."""
        if self._pair is not None:
            station.close()
            return
        try:
            vehicle = socket.create_connection(self._to, timeout=CONNECT_S)
        except (OSError, UnicodeError):
            station.close()
            return
        self._pair = _TcpConnection(station, vehicle, self._link)
        for sock in self._pair.sockets:
            self.selector.register(sock, EVENT_READ, None)

    def _disconnect(self) -> None:
        if self._pair is not None:
            for sock in self._pair.sockets:
                self.selector.unregister(sock)
                sock.close()
            self._pair = None
