"""Serial link: telemetry radios and USB cables. It comes back by itself when the device is plugged in again."""

import contextlib
import errno
import fcntl
import os
import termios
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.links.base import Link, reason
from tui_gcs.core.links.reconnect_timer import ReconnectTimer
from tui_gcs.core.links.send_queue import SendQueue
from tui_gcs.core.links.spec import LinkError, LinkSpec
from tui_gcs.core.mavlink.sources import Address

# Some frames fit always, however slow the port is: the largest MAVLink 2 frame has 280 bytes.
MIN_QUEUE_BYTES = 1024
_MAX_BYTES_PER_READ = 16384
# 8N1: a start bit, eight bits, a stop bit.
_BITS_PER_BYTE = 10


class SerialLink(Link):
    """One serial device, used by this station alone."""

    stream = True

    def __init__(self, spec: LinkSpec, clock: Clock) -> None:
        """Open the device as soon as `receive` is called."""
        super().__init__(spec)
        self.partners = [spec.device]
        self.error = "not open yet"
        self._retry = ReconnectTimer(clock)
        # A frame that waits for the line longer than a second is better repeated by its service.
        room = max(MIN_QUEUE_BYTES, spec.baud // _BITS_PER_BYTE)
        self._queue = SendQueue(room, self, clock)
        self._port: Any = None
        self._fd = -1
        self._closed = False

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`."""
        chunks: list[tuple[bytes, Address]] = []
        if self._port is None:
            if self._closed or not self._retry.due or not self._opened():
                return []
            chunks.append((b"", self.spec.device))
        try:
            data = os.read(self._fd, _MAX_BYTES_PER_READ)
        except (BlockingIOError, InterruptedError):
            self._send_waiting()
            return chunks
        except OSError as error:
            self._lose(_plain(error))
            return chunks
        # An empty read without EAGAIN: the device hung up.
        if not data:
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
            self._queue.put(data, self._write)
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

    def _opened(self) -> bool:
        """Open the device and return whether that worked."""
        try:
            self._port = open_device(self.spec)
        except LinkError as error:
            self.error = self._retry.failed(str(error))
            return False
        self._fd = self._port.fileno()
        self.error = ""
        return True

    def _write(self, data: bytes) -> int:
        return os.write(self._fd, data)

    def _send_waiting(self) -> None:
        try:
            self._queue.flush(self._write)
        except OSError as error:
            self._lose(_plain(error))

    def _lose(self, why: str) -> None:
        """Close the device, which is gone, and try again later."""
        self._release()
        self.error = self._retry.failed(why)

    def _release(self) -> None:
        """Close the device without waiting until the line has taken what is still in the system's buffer."""
        self._queue.give_up()
        port, fd = self._port, self._fd
        self._port, self._fd = None, -1
        if port is None:
            return
        with contextlib.suppress(OSError, termios.error):
            # close() would otherwise wait until a dead line has taken what is buffered.
            termios.tcflush(fd, termios.TCOFLUSH)
        with contextlib.suppress(OSError, termios.error):
            port.close()


def open_device(spec: LinkSpec) -> Any:
    """Return the device as a `serial.Serial`, locked for this process; its descriptor never blocks.

    Raises:
        LinkError: there is none, or it cannot be used; what and what to do, without the link's name.
    """
    import serial  # only stations with a serial link need it

    try:
        # inter_byte_timeout sets VMIN to 1: so a read says EAGAIN where nothing is there, and b"" only when the device
        # is gone. Reads and writes go to the descriptor: pyserial's write spins while the line is busy.
        port = serial.Serial(spec.device, spec.baud, timeout=0, inter_byte_timeout=0, write_timeout=0, exclusive=True)
    except (OSError, ValueError, OverflowError, termios.error) as error:
        raise LinkError(_plain(error)) from None
    with contextlib.suppress(OSError):
        # TIOCEXCL also keeps out programs that do not ask for the lock.
        fcntl.ioctl(port.fileno(), termios.TIOCEXCL)
    return port


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
    """Return why the device does not work, and what to do.

    pyserial and termios hide the error's number in several places.
    """
    for wrapped in (error, error.__context__):
        if wrapped is not None:
            number = getattr(wrapped, "errno", None) or (wrapped.args[0] if wrapped.args else None)
            if isinstance(number, int):
                return _ADVICE.get(number) or os.strerror(number)
    return reason(error)
