"""One established TCP connection, of the client link or of a client of `tcpin`."""

import contextlib
import socket

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.links.base import Link, reason
from tui_gcs.core.links.send_queue import SendQueue
from tui_gcs.core.mavlink.sources import Address

MAX_UNSENT_BYTES = 65536
"""About 1500 commands; further frames are refused until the partner takes some."""
_DEAD_AFTER_S = 10
"""A partner is gone when its system does not answer for this long (cable pulled, NAT entry expired)."""


class TcpConnection:
    """A TCP connection: chunks in, whole frames out; never blocks."""

    def __init__(self, tcp: socket.socket, address: Address, counts: Link, clock: Clock) -> None:
        """Take over `tcp`, which is connected to `address`; bytes are counted in `counts`."""
        self.address = address
        self.error = ""
        """Why the connection is gone; "" while it lives."""
        self.last_heard_s = clock.now()
        self._socket = tcp
        self._counts = counts
        self._clock = clock
        self._queue = SendQueue(MAX_UNSENT_BYTES, counts, clock)
        tcp.setblocking(False)
        _set_socket_options(tcp)

    def read(self, max_bytes: int) -> bytes:
        """Return what has arrived, and send what waited; b"" if nothing has, or the connection is gone."""
        if self.error:
            return b""
        try:
            data = self._socket.recv(max_bytes)
        except (BlockingIOError, InterruptedError):
            data = b""
        except OSError as error:
            self.close(reason(error))
            return b""
        else:
            if not data:
                self.close("closed by the other side")
                return b""
            self._counts.bytes_in += len(data)
            self.last_heard_s = self._clock.now()
        self._send_waiting()
        return data

    def send(self, frame: bytes) -> None:
        """Send `frame`, now or when the socket has room."""
        if self.error:
            self._counts.send_refused += 1
            return
        try:
            self._queue.put(frame, self._socket.send)
        except OSError as error:
            self.close(reason(error))

    def fileno(self) -> int:
        """Return the descriptor of the socket; -1 when it is closed."""
        return self._socket.fileno()

    def close(self, why: str) -> None:
        """Close the connection; `why` is shown unless an earlier reason is."""
        self.error = self.error or why
        self._queue.give_up()
        self._socket.close()

    def _send_waiting(self) -> None:
        if self._queue.stalled:
            self.close("takes nothing any more")
            return
        try:
            self._queue.flush(self._socket.send)
        except OSError as error:
            self.close(reason(error))


def _set_socket_options(tcp: socket.socket) -> None:
    """Send small frames at once, and let the system find out that the partner's machine is gone."""
    options = [
        (socket.IPPROTO_TCP, "TCP_NODELAY", 1),
        (socket.SOL_SOCKET, "SO_KEEPALIVE", 1),
        (socket.IPPROTO_TCP, "TCP_KEEPIDLE", _DEAD_AFTER_S // 2),
        (socket.IPPROTO_TCP, "TCP_KEEPINTVL", 1),
        (socket.IPPROTO_TCP, "TCP_KEEPCNT", _DEAD_AFTER_S // 2),
        (socket.IPPROTO_TCP, "TCP_USER_TIMEOUT", 1000 * _DEAD_AFTER_S),  # ms
    ]
    for level, name, value in options:
        if hasattr(socket, name):  # not every system has all of them
            with contextlib.suppress(OSError):
                tcp.setsockopt(level, getattr(socket, name), value)
