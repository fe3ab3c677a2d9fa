"""A line that is typed without a dialog: the screen stays in view, and every key that cannot be part of it works."""

from textual.events import Key

MOST_CELLS = 40
NUMBERS, NAMES = frozenset("0123456789,-"), frozenset("0123456789,-+=_abcdefghijklmnopqrstuvwxyz")


class LineEntry:
    """What was typed so far towards a selection."""

    def __init__(self, text: str = "", *, names: bool = False) -> None:
        """Begin with `text`; letters belong to it only with `names`, else they are the keys they always are."""
        self.text = text
        self._taken = NAMES if names else NUMBERS

    def press(self, key: Key) -> bool:
        """Whether the key is part of the line."""
        if key.key == "backspace":
            self.text = self.text[:-1]
            return True
        character = (key.character or "").lower()
        if len(character) != 1 or character not in self._taken:
            return False
        self.text = (self.text + character)[:MOST_CELLS]
        return True
