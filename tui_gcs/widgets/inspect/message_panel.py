"""The panel of one message: the fields of its newest frame with units and names, or its bytes."""

from collections.abc import Sequence

from tui_gcs.feed.message_inspection import InspectedFrame, InspectedMessage
from tui_gcs.widgets.basics.border_titles import framed, set_title, show_beyond
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, wrapped

BYTES_PER_LINE, BYTE_CELLS = 16, 4
"""A byte takes three cells as a number and one as a letter."""
OFFSET_CELLS = 5
FIELD_CELLS = 20


class MessagePanel(LinesView):
    """The newest frame of the chosen message, and what became of the last key."""

    DEFAULT_CSS = framed("MessagePanel", "height: 1fr;")

    waiting = "waiting for its newest frame"
    """What is shown until the frame is there."""
    _message: InspectedMessage | None = None
    _frame: InspectedFrame | None = None
    _outcome: Sequence[Run] = ()
    _as_bytes = False
    _first = 0

    def show(
        self,
        message: InspectedMessage | None,
        frame: InspectedFrame | None,
        outcome: Sequence[Run],
        *,
        as_bytes: bool,
    ) -> None:
        """Show the fields of this message, or its bytes; a frame of another message is not shown."""
        fits = message is not None and frame is not None and frame.key == message.row.key
        if message is None or self._message is None or message.row.key != self._message.row.key:
            self._first = 0
        self._message, self._frame, self._outcome, self._as_bytes = (
            message,
            frame if fits else None,
            outcome,
            as_bytes,
        )
        set_title(self, title_of(message) if message is not None else "message")
        self.update_lines()

    def scroll_by(self, lines: int) -> None:
        """Show lines below, or above if negative."""
        self._first = max(0, self._first + lines)
        self.update_lines()

    def copied(self) -> str:
        """Return the shown text whole, for the clipboard; "" without a message."""
        if self._message is None or self._frame is None:
            return ""
        if self._as_bytes:
            return self._frame.raw.hex(" ")
        head = f"{title_of(self._message)}\n{path_of(self._message)}"
        return "\n".join([head, *("".join(text for text, _ in line) for line in field_lines(self._frame))])

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        body = self._body(width)
        outcome: list[Line] = [[(part, ink)] for text, ink in self._outcome for part in wrapped(text, width)]
        room = max(1, height - len(outcome))
        self._first = max(0, min(self._first, len(body) - room))
        shown = body[self._first : self._first + room]
        show_beyond(self, self._first, len(body) - self._first - len(shown), "[ ]")
        return [*shown, *outcome]

    def _body(self, width: int) -> list[Line]:
        if self._message is None:
            return []
        path: list[Line] = [[(part, Ink.MUTED)] for part in wrapped(path_of(self._message), width)]
        if self._frame is None:
            return [*path, [(self.waiting, Ink.MUTED)]]
        remark: list[Line] = [[(part, Ink.CAUTION)] for part in wrapped(self._frame.remark, width) if part]
        if self._as_bytes or not self._frame.fields:
            return [*path, *remark, *byte_lines(self._frame.raw, width)]
        return [
            *path,
            *remark,
            *(part for line in field_lines(self._frame) for part in folded(line, width)),
        ]


def title_of(message: InspectedMessage) -> str:
    """Return name, number and sender of a message."""
    row = message.row
    who = f"vehicle {row.vehicle}" if row.vehicle else f"system {row.key.system}, no vehicle"
    return f"{row.name} {row.key.msgid}   {who} comp {row.key.component}"


def path_of(message: InspectedMessage) -> str:
    """Return over which path a message comes, in which version of MAVLink, and whether its frames count."""
    row = message.row
    signed = "signed" if row.signed else "unsigned"
    used = "" if row.used else "  frames do NOT count"
    return f"{row.key.link} {row.key.address}  MAVLink {row.version} {signed}{used}"


def field_lines(frame: InspectedFrame) -> list[Line]:
    """Return a line for each field: name, value as sent with its unit, and what it means."""
    lines: list[Line] = []
    for each in frame.fields:
        name = f"{each.name:<{FIELD_CELLS}} "
        means = f"  {each.means}" if each.means else ""
        lines.append([(name, Ink.MUTED), (each.sent, Ink.TEXT), (means, Ink.BOLD)])
    return lines


def folded(line: Line, width: int) -> list[Line]:
    """Return a field in as many lines as it takes, those after the first indented."""
    (name, name_ink), (sent, ink), (means, means_ink) = line
    if len(name) + len(sent) + len(means) <= width:
        return [line]
    room = max(8, width - 2)
    first: Line = [(name, name_ink), (sent, ink)]
    if len(name) + len(sent) <= width:
        return [first, *([(f"  {part}", means_ink)] for part in wrapped(means.strip(), room))]
    rest = [
        *((part, ink) for part in wrapped(sent, room)),
        *((part, means_ink) for part in wrapped(means.strip(), room)),
    ]
    return [[(name, name_ink)], *([(f"  {part}", part_ink)] for part, part_ink in rest if part)]


def byte_lines(raw: bytes, width: int) -> list[Line]:
    """Return a frame as hexadecimal numbers and letters, each line with the offset of its first byte."""
    room = OFFSET_CELLS + BYTES_PER_LINE * BYTE_CELLS
    count = BYTES_PER_LINE if width >= room else BYTES_PER_LINE // 2
    lines: list[Line] = []
    for at in range(0, len(raw), count):
        piece = raw[at : at + count]
        text = "".join(chr(byte) if 0x20 <= byte < 0x7F else "." for byte in piece)
        lines.append([(f"{at:03x}  ", Ink.MUTED), (f"{piece.hex(' '):<{3 * count}}", Ink.TEXT), (text, Ink.MUTED)])
    return lines
