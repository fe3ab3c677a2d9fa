"""TCP client link (simulators, routers). It reconnects by itself, driven by `receive` and the injected clock."""

import errno
import os
import socket

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.links.base import Link
from tui_gcs.core.links.reconnect_timer import ReconnectTimer
from tui_gcs.core.links.resolve import ResolvedAddress
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.links.tcp_connection import TcpConnection
from tui_gcs.core.mavlink.sources import Address

# A host that is switched off answers nothing at all; the system itself would wait for two minutes.
_CONNECT_TIMEOUT_S = 5.0
_MAX_BYTES_PER_READ = 16384
"""Taken per `receive`: 1700 telemetry frames."""


class TcpLink(Link):
    """A TCP client with one connection at a time."""

    stream = True

    def __init__(self, spec: LinkSpec, place: ResolvedAddress, clock: Clock) -> None:
        """Connect to `place` as soon as `receive` is called."""
        super().__init__(spec)
        self.partners = [place.address]
        self.error = "not connected yet"
        self._place = place
        self._clock = clock
        self._retry = ReconnectTimer(clock)
        self._connecting: socket.socket | None = None
        self._deadline_s = 0.0
        self._connection: TcpConnection | None = None
        self._closed = False

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`."""
        chunks: list[tuple[bytes, Address]] = []
        if self._connection is None:
            self._connection = self._connect()
            if self._connection is None:
                return []
            chunks.append((b"", self._place.address))
        data = self._connection.read(_MAX_BYTES_PER_READ)
        if data:
            self._retry.worked()
            chunks.append((data, self._place.address))
        self._drop_if_gone()
        return chunks

    def send(self, data: bytes, to: Address) -> None:
        """See `Link.send`; `to` is always the one partner."""
        if self._connection is None:
            self.send_refused += 1
            return
        self._connection.send(data)
        self._drop_if_gone()

    def filenos(self) -> list[int]:
        """See `Link.filenos`; none while connecting."""
        return [self._connection.fileno()] if self._connection is not None else []

    def close(self) -> None:
        """See `Link.close`."""
        self._closed = True
        self.error = "closed"
        if self._connecting is not None:
            self._connecting.close()
        if self._connection is not None:
            self._connection.close(self.error)
        self._connecting = self._connection = None

    def _connect(self) -> TcpConnection | None:
        """Begin or continue to connect; return the connection once it is established."""
        if self._connecting is None and self._retry.due and not self._closed:
            self._begin()
        tcp = self._connecting
        if tcp is None:
            return None
        result = tcp.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if result:
            self._failed(os.strerror(result))
            return None
        try:
            itself = tcp.getpeername() == tcp.getsockname()
        except OSError:  # not connected yet
            if self._clock.now() >= self._deadline_s:
                self._failed("no answer")
            return None
        # A loopback port without a listener, and the system picked the same port for our end.
        if itself:
            self._failed("nothing listens there")
            return None
        self._connecting, self.error = None, ""
        return TcpConnection(tcp, self._place.address, self, self._clock)

    def _begin(self) -> None:
        """Start to connect without waiting."""
        try:
            self._connecting = socket.socket(self._place.family, socket.SOCK_STREAM)
            self._connecting.setblocking(False)
            result = self._connecting.connect_ex(self._place.address)
        except OSError as error:  # no descriptor left
            result = error.errno or errno.EIO
        if result not in (0, errno.EINPROGRESS, errno.EWOULDBLOCK):
            self._failed(os.strerror(result))
        self._deadline_s = self._clock.now() + _CONNECT_TIMEOUT_S

    def _drop_if_gone(self) -> None:
        """Drop a connection that has ended, and try again later."""
        if self._connection is not None and self._connection.error:
            self.error = self._retry.failed(self._connection.error)
            self._connection = None

    def _failed(self, why: str) -> None:
        if self._connecting is not None:
            self._connecting.close()
        self._connecting = None
        self.error = self._retry.failed(why)
