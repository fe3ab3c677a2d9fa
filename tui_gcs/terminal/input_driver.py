"""A driver that can tell whether the terminal keeps up, waits for none, loses no Esc, and takes no floods for keys.

Textual writes through a queue of 30 whose `put` blocks the event loop; a terminal that stops reading would freeze the
console for seconds (facts/terminal.md B4). The feed posts nothing while this driver lags, what finds the queue full is
lost, and a console that ends behind such a terminal takes back what was not read.

A key that comes right behind Esc (tmux holds Esc back for half a second) is for Textual that key with Alt, or without.

Uses private parts of Textual 8.2.8, here and nowhere else; a test fails when they are gone.
"""

import contextlib
import signal
import termios
import time
from collections.abc import Iterable
from queue import Empty, Full
from threading import Thread

from textual._xterm_parser import XTermParser
from textual.driver import Driver
from textual.drivers import linux_driver
from textual.drivers.linux_driver import LinuxDriver
from textual.events import Key
from textual.message import Message

from tui_gcs.terminal.input_filter import InputFilter

QUEUED_WRITES_MAX = 3
MOST_COLUMNS, MOST_LINES = 500, 150
READS_WITHIN_S, CLOSE_S = 0.5, 3.0
"""A terminal that reads has read the last words by then; and for so long one that does not is asked to forget."""

_BEGIN_SEQUENCES = frozenset("[OP]_^X\x1b")
"""What may stand second in something that a terminal sends for one key, or as an answer."""


class InputDropped(Message):
    """More came from the terminal than anybody types: so many characters were not taken."""

    def __init__(self, characters: int) -> None:
        super().__init__()
        self.characters = characters


class EscapeKeyParser(XTermParser):
    """Textual's reader of the terminal's bytes, in which Esc and the key behind it are two keys."""

    def __init__(self, debug: bool = False) -> None:
        """Nothing was typed yet."""
        self._sieve = InputFilter()
        super().__init__(debug)

    def feed(self, data: str) -> Iterable[Message]:
        """See `XTermParser.feed`; no data means that there will be no more."""
        kept = self._sieve.sift(data, time.monotonic())
        if kept or not data:
            yield from super().feed(kept)
        if dropped := self._sieve.take_dropped():
            yield InputDropped(dropped)

    def _sequence_to_key_events(self, sequence: str, alt: bool = False) -> Iterable[Key]:
        if alt or (len(sequence) == 2 and sequence[0] == "\x1b" and sequence[1] not in _BEGIN_SEQUENCES):
            yield Key("escape", "\x1b")
            sequence = sequence[-1:]
        yield from super()._sequence_to_key_events(sequence)


linux_driver.XTermParser = EscapeKeyParser  # type: ignore[attr-defined]  # the driver makes it by that name


class NonBlockingDriver(LinuxDriver):
    """The Unix driver, with a look at its queue of writes, that waits for no terminal."""

    def _get_terminal_size(self) -> tuple[int, int]:
        """As large as the terminal, or as one that is painted within a second."""
        columns, lines = super()._get_terminal_size()
        return min(columns, MOST_COLUMNS), min(lines, MOST_LINES)

    def _sigtstp_application(self, *_: object) -> None:
        """Stop, and later go on, between two turns of the loop.

        A signal comes in the middle of anything: in the middle of a write, whose lock is taken then, what gives the
        terminal back would wait for that lock for ever.
        """
        self._loop.call_soon_threadsafe(super()._sigtstp_application)

    def _sigcont_application(self, *_: object) -> None:
        """See `_sigtstp_application`."""
        self._loop.call_soon_threadsafe(super()._sigcont_application)

    def write(self, data: str) -> None:
        """Queue `data`; where the queue is full it is lost, and all is painted anew when the terminal reads again."""
        if self._writer_thread is not None:
            with contextlib.suppress(Full):
                self._writer_thread._queue.put_nowait(data)

    def stop_application_mode(self) -> None:
        """As ever; pictures that nobody has read are not in the way of the last words."""
        if self._writer_thread is not None and self.lagging:
            with contextlib.suppress(Empty):
                while True:
                    self._writer_thread._queue.get_nowait()
        super().stop_application_mode()

    def close(self) -> None:
        """Write what waits, then end; what a terminal does not read is taken back from it."""
        writer, end_s = self._writer_thread, time.monotonic() + CLOSE_S
        if writer is None:
            return
        self._writer_thread = None
        writer._queue.put_nowait(None)
        writer.join(READS_WITHIN_S)
        while writer.is_alive() and time.monotonic() < end_s:
            with contextlib.suppress(termios.error, ProcessLookupError):  # terminal or writer are gone
                termios.tcflush(writer.fileno(), termios.TCOFLUSH)
                _wake(writer)
            writer.join(0.02)

    @property
    def lagging(self) -> bool:
        """Whether more writes wait than a terminal that reads would leave waiting."""
        writer = self._writer_thread
        return writer is not None and writer._queue.qsize() > QUEUED_WRITES_MAX


def _wake(thread: Thread) -> None:
    """Have it look again whether the terminal takes its bytes: a flush alone wakes nobody who waits to write."""
    if thread.ident is not None:
        signal.signal(signal.SIGURG, lambda *_: None)
        signal.pthread_kill(thread.ident, signal.SIGURG)


def lagging(driver: Driver | None) -> bool:
    """Whether the terminal behind `driver` is not keeping up; other drivers (headless, web) never lag."""
    return isinstance(driver, NonBlockingDriver) and driver.lagging
