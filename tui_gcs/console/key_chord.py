"""`!` then `h`, `r` or `l`: all hold, return or land. Works from anywhere, before any widget sees the keys.

Any other key after `!` is not lost: both go where they would have gone.
"""

from textual.events import Key

PREFIX_S = 3.0
CHORDS = {"h": "hold_all", "r": "return_all", "l": "land_all"}
"""Second key: the app's action."""


class KeyChord:
    """Two keys; knows nothing of screens."""

    def __init__(self) -> None:
        """No prefix yet."""
        self._prefix: Key | None = None
        self._until_s = 0.0

    def is_waiting(self, now_s: float) -> bool:
        """Whether `!` was pressed and its second key is awaited; not any longer than it would be taken."""
        return self._prefix is not None and now_s <= self._until_s

    def press(self, key: Key, now_s: float) -> tuple[str, list[Key]]:
        """(action to do now or "", keys to handle as usual) for one key, pressed at a time in seconds."""
        held, self._prefix = self._prefix, None
        if held is not None and now_s <= self._until_s:
            if key.character is not None and key.character.lower() in CHORDS:
                return CHORDS[key.character.lower()], []
            if key.key == "escape":
                return "", []
        if key.character == "!":
            self._prefix, self._until_s = key, now_s + PREFIX_S
            return "", [held] if held is not None else []
        return "", [held, key] if held is not None else [key]
