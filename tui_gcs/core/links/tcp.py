"""A TCP client link (simulators, routers). Reconnects by itself, driven by `receive` and the injected clock."""

import errno
import os
import socket

from tui_gcs.core.clock import Clock
from tui_gcs.core.links.base import Address
from tui_gcs.core.wire.frames import StreamCutter

FIRST_RETRY_S = 1.0
LAST_RETRY_S = 10.0
_CONNECT_TIMEOUT_S = 5.0
_READ_BYTES = 65536
_MAX_READS = 32
_MAX_UNSENT_BYTES = 65536
"""Half a minute of commands; a partner that takes nothing gets nothing more."""


class TcpLink:
    """One connection at a time. `receive` gives one frame per entry, as if they were datagrams."""

    def __init__(self, name: str, address: tuple[str, int], clock: Clock) -> None:
        """Connect to `address` as soon as `receive` is called."""
        self.name = name
        self.error = "not connected yet"
        self._address = address
        self._clock = clock
        self._socket: socket.socket | None = None
        self._connected = False
        self._closed = False
        self._deadline_s = 0.0
        self._next_try_s = clock.now()
        self._retry_s = FIRST_RETRY_S
        self._unsent = b""
        self._cutter = StreamCutter()

    @property
    def junk_bytes(self) -> int:
        """Bytes of the present connection that belonged to no good frame."""
        return self._cutter.junk_bytes

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`; also connects, reconnects and sends what was waiting."""
        if self._closed:
            return []
        if self._socket is None:
            if self._clock.now() >= self._next_try_s:
                self._connect()
            return []
        if not self._connected and not self._finish_connect():
            return []
        frames: list[tuple[bytes, Address]] = []
        for _ in range(_MAX_READS):
            data = self._read()
            if not data:
                break
            frames.extend((frame.raw, self._address) for frame in self._cutter.feed(data))
        self._send_rest()
        return frames

    def send(self, data: bytes, to: Address) -> None:
        """See `Link.send`; `to` is always the one partner."""
        if not self._connected or len(self._unsent) + len(data) > _MAX_UNSENT_BYTES:
            return
        self._unsent += data
        self._send_rest()

    def fileno(self) -> int | None:
        """See `Link.fileno`."""
        return self._socket.fileno() if self._socket is not None and self._connected else None

    def close(self) -> None:
        """See `Link.close`."""
        self._closed = True
        if self._socket is not None:
            self._socket.close()
        self._socket, self._connected = None, False

    def _connect(self) -> None:
        """Begin to connect."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        self._deadline_s = self._clock.now() + _CONNECT_TIMEOUT_S
        result = self._socket.connect_ex(self._address)
        if result not in (0, errno.EINPROGRESS, errno.EWOULDBLOCK):
            self._lose(os.strerror(result))

    def _finish_connect(self) -> bool:
        """Whether the connection is there now."""
        tcp = self._socket
        if tcp is None:
            return False
        result = tcp.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if result:
            self._lose(os.strerror(result))
            return False
        try:
            tcp.getpeername()
        except OSError:  # still connecting
            if self._clock.now() >= self._deadline_s:
                self._lose("no answer")
            return False
        tcp.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._connected, self.error, self._unsent = True, "", b""
        self._cutter = StreamCutter()
        return True

    def _read(self) -> bytes:
        """What is there; empty if nothing is, or the connection is gone."""
        if self._socket is None:
            return b""
        try:
            data = self._socket.recv(_READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError as error:
            self._lose(error.strerror or str(error))
            return b""
        if data:
            self._retry_s = FIRST_RETRY_S
        else:
            self._lose("closed by the other side")
        return data

    def _send_rest(self) -> None:
        """Send what is waiting, as far as the socket takes it."""
        if not self._unsent or self._socket is None:
            return
        try:
            sent = self._socket.send(self._unsent)
        except BlockingIOError:
            return
        except OSError as error:
            self._lose(error.strerror or str(error))
            return
        self._unsent = self._unsent[sent:]

    def _lose(self, why: str) -> None:
        """The connection is gone: try again later, each time twice as late."""
        if self._socket is not None:
            self._socket.close()
        self._socket, self._connected, self._unsent = None, False, b""
        self.error = f"{why}; next try in {self._retry_s:.0f} s"
        self._next_try_s = self._clock.now() + self._retry_s
        self._retry_s = min(2 * self._retry_s, LAST_RETRY_S)
