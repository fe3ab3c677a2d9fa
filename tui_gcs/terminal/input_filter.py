"""Of what a terminal sends, what an operator can have typed: the rest never becomes keys.

A megabyte that was pasted by mistake would be a million keys, minutes of work and a gigabyte of memory, and in them any
command. What comes in brackets (terminals mark a paste) is one line of text for a field. More keys at once than
fingers type are a paste without brackets, or a mouse gone wild: all of it is dropped until the terminal is quiet.
"""

import re

BEGIN, END = "\x1b[200~", "\x1b[201~"
"""Around what is pasted, after the terminal was asked for it (DEC private mode 2004)."""
MAX_PASTED = 1000
MAX_AT_ONCE, KEYS_PER_S = 300.0, 200.0
"""What is typed while a slow link stands still comes at once; a mouse that moves sends some 100 reports a second."""
QUIET_S = 0.3
"""So long without a byte, and a flood is over."""
LOST_END_S = 2.0
"""So long, and so is a paste whose end never came; a link that stalls in the middle of one is quiet, too."""
_SEQUENCE = re.compile("\x1b[\\[O][0-9;:<=>?]*[ -/]*[@-~]")


class InputFilter:
    """Stands before the reader of keys; times are seconds of one steady clock."""

    def __init__(self) -> None:
        """Nothing was typed yet."""
        self._heard_s = 0.0
        self._left = MAX_AT_ONCE
        """Keys that may come now."""
        self._is_flood = False
        self._pasted: str | None = None
        """What was pasted so far; None: nothing is being pasted."""
        self._tail = ""
        """The last characters: a mark may come in two pieces."""
        self._dropped = 0

    def sift(self, data: str, now_s: float) -> str:
        """What is left of `data`."""
        quiet_s, self._heard_s = now_s - self._heard_s, now_s
        self._left = min(MAX_AT_ONCE, self._left + quiet_s * KEYS_PER_S)
        kept = self._forget_unfinished() if quiet_s >= (QUIET_S if self._pasted is None else LOST_END_S) else ""
        while data:
            if self._pasted is None:
                typed, data, found = self._until(BEGIN, data)
                kept += self._typed(typed) or (BEGIN if found else "")
                self._pasted = "" if found else None
            else:
                text, data, found = self._until(END, data)
                self._pasted += text
                if found:
                    kept += self._line(self._pasted.removesuffix(END)) + END
                    self._pasted = None
                elif len(self._pasted) > 2 * MAX_PASTED:
                    self._dropped += len(self._pasted) - MAX_PASTED
                    self._pasted = self._pasted[:MAX_PASTED]
        return kept

    def take_dropped(self) -> int:
        """How many characters were dropped since asked last."""
        dropped, self._dropped = self._dropped, 0
        return dropped

    def _forget_unfinished(self) -> str:
        """A flood is over, or a paste whose end never came: what the reader of keys has to be told of that."""
        told = "" if self._pasted is None else END
        self._is_flood, self._pasted, self._tail = False, None, ""
        return told

    def _until(self, mark: str, data: str) -> tuple[str, str, bool]:
        """(what comes up to the mark and with it, what comes behind it, whether there is one)."""
        joined = self._tail + data
        at = joined.find(mark)
        if at < 0:
            self._tail = joined[1 - len(mark) :]
            return data, "", False
        behind = at + len(mark) - len(self._tail)
        self._tail = ""
        return data[:behind], data[behind:], True

    def _typed(self, data: str) -> str:
        """All of it, or nothing: half of a sequence would be other keys."""
        keys = len(_SEQUENCE.sub(".", data))
        self._is_flood = self._is_flood or keys > self._left
        if self._is_flood:
            self._dropped += len(data)
            return ""
        self._left -= keys
        return data

    def _line(self, pasted: str) -> str:
        """The first line, visible characters only: fields have one line."""
        text = pasted[:MAX_PASTED].strip()
        line = re.split("[\r\n]", text, maxsplit=1)[0]
        self._dropped += max(0, len(pasted) - MAX_PASTED) + len(text) - len(line)
        return "".join(character for character in line if character.isprintable())
