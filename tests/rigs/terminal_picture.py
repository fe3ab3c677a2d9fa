"""What a terminal shows after the bytes that a console wrote: plain text, without colours."""

import re

_PIECE = re.compile(r"\x1b\[([0-9;?<>=]*)[ -/]*([@-~])|\x1b[^\[]|([\x00-\x1f])|([^\x1b\x00-\x1f])")


class TerminalPicture:
    """Cells of a terminal; understands moves, erasing and text, as consoles write them."""

    def __init__(self, columns: int, lines: int) -> None:
        """Blank."""
        self._cells = [[" "] * columns for _ in range(lines)]
        self._x = self._y = 0
        self._rest = ""

    def feed(self, data: str) -> None:
        """Take bytes that were decoded; what is cut at the end waits for the next ones."""
        data = self._rest + data
        cut = re.search(r"\x1b(\[[0-9;?<>=]*)?\Z", data)
        self._rest = data[cut.start() :] if cut else ""
        for match in _PIECE.finditer(data[: cut.start()] if cut else data):
            values, final, control, text = match.groups()
            if text:
                self._put(text)
            elif control:
                self._x = 0 if control == "\r" else self._x
                self._y += control == "\n"
            elif final is not None and not values.startswith(("?", "<", ">", "=")):
                self._control(final, [int(value or 0) for value in values.split(";")])

    def text(self) -> str:
        """All lines."""
        return "\n".join("".join(line).rstrip() for line in self._cells)

    def _put(self, text: str) -> None:
        if 0 <= self._y < len(self._cells) and 0 <= self._x < len(self._cells[self._y]):
            self._cells[self._y][self._x] = text
        self._x += 1

    def _control(self, final: str, values: list[int]) -> None:
        if final == "H":
            line, column = [*values, 1][:2]
            self._y, self._x = max(1, line) - 1, max(1, column) - 1
        elif final == "C":
            self._x += max(1, values[0])
        elif final == "J" and values[0] == 2:
            self._cells = [[" "] * len(line) for line in self._cells]
