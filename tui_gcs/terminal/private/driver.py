"""The Unix driver, which can report whether the terminal keeps up, and never waits for it.

Textual writes through a queue of 30 whose `put` blocks the event loop: a terminal that stopped reading for 10 s froze
the console for 6.7 s (docs/terminal.md B4). With this driver what finds the queue full is lost, and a console that ends
behind such a terminal discards what was not read.
"""

import contextlib
import signal
import termios
import time
from queue import Empty, Full
from threading import Thread

from textual.driver import Driver
from textual.drivers._writer_thread import WriterThread
from textual.drivers.linux_driver import LinuxDriver

from tui_gcs.terminal.private.key_parser import use_escape_key_parser

MAX_QUEUED_WRITES = 3
"""With it the longest gap of the loop behind a stalled terminal was 0.18 s instead of 6.7 s (docs/terminal.md B4)."""
MAX_COLUMNS, MAX_LINES = 500, 150
"""Cells of a terminal that is painted within a second."""
READS_WITHIN_S = 0.5
"""A terminal that reads has read the last words by then."""
CLOSE_S = 3.0
"""A terminal that does not read is asked to discard its input for this long when the console ends."""


class WriteQueue:
    """The queue between the event loop and the thread that writes to the terminal.

    Private: `WriterThread._queue`. Its public `write` blocks when the queue is full.
    """

    def __init__(self, writer: WriterThread) -> None:
        self._writer = writer

    @property
    def is_behind(self) -> bool:
        """Whether more writes wait than a terminal that reads would leave waiting."""
        return self._writer._queue.qsize() > MAX_QUEUED_WRITES

    def put(self, data: str) -> None:
        """Queue `data`; where the queue is full it is lost."""
        with contextlib.suppress(Full):
            self._writer._queue.put_nowait(data)

    def drop_all(self) -> None:
        """Drop everything that waits."""
        with contextlib.suppress(Empty):
            while True:
                self._writer._queue.get_nowait()

    def end(self) -> None:
        """Let the thread write what waits, then end; what a terminal does not read is discarded."""
        writer, end_s = self._writer, time.monotonic() + CLOSE_S
        writer._queue.put_nowait(None)  # Textual's sign for the thread to end
        writer.join(READS_WITHIN_S)
        while writer.is_alive() and time.monotonic() < end_s:
            with contextlib.suppress(termios.error, ProcessLookupError):  # terminal or writer are gone
                termios.tcflush(writer.fileno(), termios.TCOFLUSH)
                _interrupt(writer)
            writer.join(0.02)


class NonBlockingDriver(LinuxDriver):
    """Textual's Unix driver without its blocking writes.

    Private: `LinuxDriver._writer_thread`, `_get_terminal_size`, `_sigtstp_application`, `_sigcont_application` and
    `Driver._loop`. A driver has no public way to write without blocking, to limit its size or to defer a signal.
    """

    def _get_terminal_size(self) -> tuple[int, int]:
        columns, lines = super()._get_terminal_size()
        return min(columns, MAX_COLUMNS), min(lines, MAX_LINES)

    def _sigtstp_application(self, *_: object) -> None:
        # A signal may arrive in the middle of a write, whose lock is taken then: giving the terminal back from here
        # would wait for that lock for ever. Between two turns of the loop no lock is taken.
        self._loop.call_soon_threadsafe(super()._sigtstp_application)

    def _sigcont_application(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(super()._sigcont_application)

    def write(self, data: str) -> None:
        """Queue `data`; where the queue is full it is lost, and all is painted anew when the terminal reads again."""
        if self._writer_thread is not None:
            WriteQueue(self._writer_thread).put(data)

    def stop_application_mode(self) -> None:
        """Restore the terminal; pictures that it has not read are dropped, so that they do not delay that."""
        if self._writer_thread is not None and self.lagging:
            WriteQueue(self._writer_thread).drop_all()
        super().stop_application_mode()

    def close(self) -> None:
        """Write what waits, then end; what a terminal does not read is discarded."""
        if (writer := self._writer_thread) is not None:
            self._writer_thread = None
            WriteQueue(writer).end()

    @property
    def lagging(self) -> bool:
        """Whether the terminal does not keep up."""
        return self._writer_thread is not None and WriteQueue(self._writer_thread).is_behind


def _interrupt(thread: Thread) -> None:
    """Interrupt a thread that waits in a write: discarding the terminal's input alone does not wake it."""
    if thread.ident is not None:
        signal.signal(signal.SIGURG, lambda *_: None)
        signal.pthread_kill(thread.ident, signal.SIGURG)


def lagging(driver: Driver | None) -> bool:
    """Whether the terminal behind `driver` is not keeping up; other drivers (headless, web) never lag."""
    return isinstance(driver, NonBlockingDriver) and driver.lagging


def non_blocking(driver: type[Driver]) -> type[Driver]:
    """The class to use instead of `driver`: the Unix driver is replaced, others stay."""
    if driver is not LinuxDriver:
        return driver
    use_escape_key_parser()
    return NonBlockingDriver
