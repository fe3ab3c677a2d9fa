"""A driver that can tell whether the terminal keeps up.

Textual writes through a queue of 30 whose `put` blocks the event loop; a terminal that stops reading would freeze the
console for seconds (facts/terminal.md B4). The feed posts nothing while this driver lags. And one that loses no Esc: a
key that comes right behind it (tmux holds Esc back for half a second) is for Textual that key with Alt, or without.
Uses private parts of Textual 8.2.8, here and nowhere else; a test fails when they are gone.
"""

from collections.abc import Iterable

from textual._xterm_parser import XTermParser
from textual.driver import Driver
from textual.drivers import linux_driver
from textual.drivers.linux_driver import LinuxDriver
from textual.events import Key

QUEUED_WRITES_MAX = 3


_BEGIN_SEQUENCES = frozenset("[OP]_^X\x1b")
"""What may stand second in something that a terminal sends for one key, or as an answer."""


class EscapeParser(XTermParser):
    """Textual's reader of the terminal's bytes, in which Esc and the key behind it are two keys."""

    def _sequence_to_key_events(self, sequence: str, alt: bool = False) -> Iterable[Key]:
        if alt or (len(sequence) == 2 and sequence[0] == "\x1b" and sequence[1] not in _BEGIN_SEQUENCES):
            yield Key("escape", "\x1b")
            sequence = sequence[-1:]
        yield from super()._sequence_to_key_events(sequence)


linux_driver.XTermParser = EscapeParser  # type: ignore[attr-defined]  # the driver makes it by that name


class PatientDriver(LinuxDriver):
    """The Unix driver, with a look at its queue of writes."""

    @property
    def lagging(self) -> bool:
        """Whether more writes wait than a terminal that reads would leave waiting."""
        writer = self._writer_thread
        return writer is not None and writer._queue.qsize() > QUEUED_WRITES_MAX


def lagging(driver: Driver | None) -> bool:
    """Whether the terminal behind `driver` is not keeping up; other drivers (headless, web) never lag."""
    return isinstance(driver, PatientDriver) and driver.lagging
