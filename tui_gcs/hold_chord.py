"""`!` then `h`: HOLD ALL from anywhere, before any widget sees the keys.

Any other key after `!` is not lost: both go where they would have gone.
"""

from textual.events import Key

PREFIX_S = 2.0


class HoldChord:
    """Two keys; knows nothing of screens."""

    def __init__(self) -> None:
        """No prefix yet."""
        self._prefix: Key | None = None
        self._until_s = 0.0

    @property
    def waiting(self) -> bool:
        """Whether `!` was pressed and its second key is awaited."""
        return self._prefix is not None

    def press(self, key: Key, now_s: float) -> tuple[bool, list[Key]]:
        """(hold all now, keys to handle as usual) for one key at a time in seconds."""
        held, self._prefix = self._prefix, None
        if held is not None and now_s <= self._until_s:
            if key.character in ("h", "H"):
                return True, []
            if key.key == "escape":
                return False, []
        if key.character == "!":
            self._prefix, self._until_s = key, now_s + PREFIX_S
            return False, [held] if held is not None else []
        return False, [held, key] if held is not None else [key]
