"""The reader of what the terminal sends: the private part `textual._xterm_parser`."""

import time
from collections.abc import Iterable

from textual._xterm_parser import XTermParser
from textual.drivers import linux_driver
from textual.events import Key
from textual.message import Message

from tui_gcs.terminal.input_filter import InputDropped, InputFilter

_BEGIN_SEQUENCES = frozenset("[OP]_^X\x1b")
"""What may stand second in a sequence that a terminal sends for one key, or as an answer."""


class EscapeKeyParser(XTermParser):
    """Textual's parser, in which Esc and the key behind it are two keys, and floods are no keys.

    Private: `XTermParser.feed`, `XTermParser._sequence_to_key_events`, and the name under which `linux_driver` creates
    the parser. tmux holds Esc back for half a second to see whether a sequence follows: a key typed right behind it is
    for Textual that key with Alt, or without Esc. There is no public hook before keys are made.
    """

    def __init__(self, debug: bool = False) -> None:
        self._filter = InputFilter()
        super().__init__(debug)

    def feed(self, data: str) -> Iterable[Message]:
        """See `XTermParser.feed`; no data means that there will be no more."""
        kept = self._filter.filtered(data, time.monotonic())
        if kept or not data:
            yield from super().feed(kept)
        if dropped := self._filter.take_dropped():
            yield InputDropped(dropped)

    def _sequence_to_key_events(self, sequence: str, alt: bool = False) -> Iterable[Key]:
        if alt or (len(sequence) == 2 and sequence[0] == "\x1b" and sequence[1] not in _BEGIN_SEQUENCES):
            yield Key("escape", "\x1b")
            sequence = sequence[-1:]
        yield from super()._sequence_to_key_events(sequence)


def use_escape_key_parser() -> None:
    """Have Textual's Unix driver create this parser: it does so by the name in its module."""
    linux_driver.XTermParser = EscapeKeyParser  # type: ignore[attr-defined]
