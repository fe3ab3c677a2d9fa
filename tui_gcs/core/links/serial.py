"""A serial link: telemetry radios and USB cables. Comes back by itself when the device is unplugged and plugged in."""

import contextlib
import errno
import fcntl
import os
import termios
from typing import Any

from tui_gcs.core.clock import Clock
from tui_gcs.core.links.base import Address, LinkState, reason
from tui_gcs.core.links.outbox import Outbox
from tui_gcs.core.links.retry import Retry
from tui_gcs.core.links.spec import LinkSpec

LEAST_UNSENT_BYTES = 1024
_MOST_BYTES = 65536
_BITS_PER_BYTE = 10


class SerialLink(LinkState):
    """One device, used by this station alone."""

    stream = True

    def __init__(self, spec: LinkSpec, clock: Clock) -> None:
        """Open the device as soon as `receive` is called."""
        super().__init__(spec)
        self.error = "not open yet"
        self._retry = Retry(clock)
        # What waits longer than a second for the line is better asked again by the service that wants it.
        room = max(LEAST_UNSENT_BYTES, spec.baud // _BITS_PER_BYTE)
        self._outbox = Outbox(room, self, clock)
        self._port: Any = None
        self._fd = -1
        self._closed = False

    @property
    def partners(self) -> list[Address]:
        """See `Link.partners`."""
        return [self.spec.device]

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`."""
        chunks: list[tuple[bytes, Address]] = []
        if self._port is None:
            if self._closed or not self._retry.due or not self._open():
                return []
            chunks.append((b"", self.spec.device))
        try:
            data = os.read(self._fd, _MOST_BYTES)
        except (BlockingIOError, InterruptedError):
            self._send_waiting()
            return chunks
        except OSError as error:
            self._lose(_plain(error))
            return chunks
        if not data:  # hung up
            self._lose("unplugged")
            return chunks
        self._retry.worked()
        self.bytes_in += len(data)
        self._send_waiting()
        return [*chunks, (data, self.spec.device)]

    def send(self, data: bytes, to: Address) -> None:
        """See `Link.send`; `to` is always the one device."""
        if self._port is None:
            self.send_refused += 1
            return
        try:
            self._outbox.put(data, self._write)
        except OSError as error:
            self._lose(_plain(error))

    def filenos(self) -> list[int]:
        """See `Link.filenos`."""
        return [self._fd] if self._port is not None else []

    def close(self) -> None:
        """See `Link.close`."""
        self._closed = True
        self._release()
        self.error = "closed"

    def _open(self) -> bool:
        """Open the device; whether that worked."""
        import serial  # only stations with a serial link need it

        try:
            # inter_byte_timeout sets VMIN to 1: so a read says EAGAIN where nothing is there, and b"" only when the
            # device is gone. Reads and writes go to the descriptor: pyserial's write spins while the line is busy.
            self._port = serial.Serial(
                self.spec.device, self.spec.baud, timeout=0, inter_byte_timeout=0, write_timeout=0, exclusive=True
            )
            self._fd = self._port.fileno()
            with contextlib.suppress(OSError):
                fcntl.ioctl(self._fd, termios.TIOCEXCL)  # for programs that do not ask for the lock
        except (OSError, ValueError, OverflowError, termios.error) as error:
            self._release()
            self.error = self._retry.failed(_plain(error))
            return False
        self.error = ""
        return True

    def _write(self, data: bytes) -> int:
        return os.write(self._fd, data)

    def _send_waiting(self) -> None:
        try:
            self._outbox.flush(self._write)
        except OSError as error:
            self._lose(_plain(error))

    def _lose(self, why: str) -> None:
        """The device is gone: try again later."""
        self._release()
        self.error = self._retry.failed(why)

    def _release(self) -> None:
        """Close the device without waiting until the line has taken what is still in the system's buffer."""
        self._outbox.give_up()
        port, fd = self._port, self._fd
        self._port, self._fd = None, -1
        if port is None:
            return
        with contextlib.suppress(OSError, termios.error):
            termios.tcflush(fd, termios.TCOFLUSH)
        with contextlib.suppress(OSError, termios.error):
            port.close()


_ADVICE = {
    errno.ENOENT: "no such device. Plug it in or check the name",
    errno.ENXIO: "no such device. Plug it in or check the name",
    errno.ENODEV: "no such device. Plug it in or check the name",
    errno.EACCES: "no permission for the device. Join the group that owns it (often dialout)",
    errno.EAGAIN: "another program uses the device. Close it there",
    errno.EBUSY: "another program uses the device. Close it there",
    errno.ENOTTY: "not a serial device",
    errno.EIO: "unplugged",
}


def _plain(error: Exception) -> str:
    """Why the device does not work, and what to do."""
    number = getattr(error, "errno", None)
    if number is None:  # pyserial wraps some errors without their number
        inner = error.args[0] if error.args else None
        number = inner if isinstance(inner, int) else None
    return _ADVICE.get(number or 0) or reason(error)
