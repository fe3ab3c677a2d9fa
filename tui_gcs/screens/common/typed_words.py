"""Words that are typed to search a list: they take all keys until Enter keeps them or Esc drops them."""

from textual import events

MAX_LENGTH = 40


class TypedWords:
    """The words, and whether keys are letters of them now."""

    def __init__(self) -> None:
        self.words = ""
        self.is_typing = False

    def take(self, event: events.Key) -> bool:
        """Take a key if words are being typed; returns whether it was taken."""
        if not self.is_typing:
            return False
        event.stop()
        event.prevent_default()
        if event.key in ("enter", "escape"):
            self.is_typing = False
            self.words = "" if event.key == "escape" else self.words
        elif event.key == "backspace":
            self.words = self.words[:-1]
        elif event.character is not None and event.is_printable:
            self.words = (self.words + event.character)[:MAX_LENGTH]
        return True

    def title(self, name: str) -> str:
        """Return what stands in a list's title: "find: wor_ (Enter keeps, Esc ends)"; "" without words."""
        if not self.words and not self.is_typing:
            return ""
        return f"{name}: {self.words}{'_ (Enter keeps, Esc ends)' if self.is_typing else ''}"
