"""Of what a terminal sends, what an operator can have typed: the rest never becomes keys.

A megabyte that was pasted by mistake would be a million keys: minutes of work, a gigabyte of memory, and any command
among them (docs/threats.md B.6-108). What comes in brackets (terminals mark a paste) becomes one line of text for a
field. More keys at once than fingers type are a paste without brackets, or a mouse gone wild: all of it is dropped
until the terminal is quiet.
"""

import re

from textual.message import Message

BEGIN, END = "\x1b[200~", "\x1b[201~"
"""Marks around a paste, once the terminal was asked for them (DEC private mode 2004)."""
MAX_PASTED = 1000
MAX_AT_ONCE = 300.0
"""Keys that may come at once: what is typed while a slow link stands still is delivered together."""
MAX_KEYS_PER_S = 200.0
"""A mouse that moves sends about 100 reports a second."""
QUIET_S = 0.3
"""A flood is over when no byte came for this long."""
LOST_END_S = 2.0
"""A paste without an end is over after this long; a link that stalls in the middle of a paste is quiet, too."""
_SEQUENCE = re.compile("\x1b[\\[O][0-9;:<=>?]*[ -/]*[@-~]")


class InputDropped(Message):
    """More came from the terminal than an operator can type; `characters` of it were dropped."""

    def __init__(self, characters: int) -> None:
        super().__init__()
        self.characters = characters


class InputFilter:
    """Stands before the parser of keys; times are seconds of one steady clock."""

    def __init__(self) -> None:
        self._last_heard_s = 0.0
        self._left = MAX_AT_ONCE
        """Keys that may come now."""
        self._is_flood = False
        self._pasted: str | None = None
        """What was pasted so far; None while nothing is being pasted."""
        self._tail = ""
        """The last characters, because a mark may arrive in two pieces."""
        self._dropped = 0

    def filtered(self, data: str, now_s: float) -> str:
        """Return what may become keys of the `data` that arrived now."""
        quiet_s, self._last_heard_s = now_s - self._last_heard_s, now_s
        # A token bucket: keys refill it at the rate at which fingers and mice produce them.
        self._left = min(MAX_AT_ONCE, self._left + quiet_s * MAX_KEYS_PER_S)
        kept = self._end_unfinished() if quiet_s >= (QUIET_S if self._pasted is None else LOST_END_S) else ""
        while data:
            if self._pasted is None:
                typed, data, found = self._until(BEGIN, data)
                kept += self._typed(typed) or (BEGIN if found else "")
                self._pasted = "" if found else None
            else:
                text, data, found = self._until(END, data)
                self._pasted += text
                if found:
                    kept += self._first_line(self._pasted.removesuffix(END)) + END
                    self._pasted = None
                # Without a limit here a paste whose end never comes would fill the memory.
                elif len(self._pasted) > 2 * MAX_PASTED:
                    self._dropped += len(self._pasted) - MAX_PASTED
                    self._pasted = self._pasted[:MAX_PASTED]
        return kept

    def take_dropped(self) -> int:
        """Return how many characters were dropped since the last call."""
        dropped, self._dropped = self._dropped, 0
        return dropped

    def _end_unfinished(self) -> str:
        """End a flood, or a paste without an end; return the mark that the parser then misses."""
        missing = "" if self._pasted is None else END
        self._is_flood, self._pasted, self._tail = False, None, ""
        return missing

    def _until(self, mark: str, data: str) -> tuple[str, str, bool]:
        """Return the data up to the mark and with it, the data behind it, and whether the mark was found."""
        joined = self._tail + data
        at = joined.find(mark)
        if at < 0:
            self._tail = joined[1 - len(mark) :]
            return data, "", False
        behind = at + len(mark) - len(self._tail)
        self._tail = ""
        return data[:behind], data[behind:], True

    def _typed(self, data: str) -> str:
        """Return all of `data` or nothing: half of a sequence would be other keys."""
        keys = len(_SEQUENCE.sub(".", data))
        self._is_flood = self._is_flood or keys > self._left
        if self._is_flood:
            self._dropped += len(data)
            return ""
        self._left -= keys
        return data

    def _first_line(self, pasted: str) -> str:
        """Return the visible characters of the first line, because fields have one line."""
        text = pasted[:MAX_PASTED].strip()
        line = re.split("[\r\n]", text, maxsplit=1)[0]
        self._dropped += max(0, len(pasted) - MAX_PASTED) + len(text) - len(line)
        return "".join(character for character in line if character.isprintable())
