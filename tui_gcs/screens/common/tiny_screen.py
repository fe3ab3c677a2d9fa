"""The screen of a terminal below 80x24: the number of armed vehicles, the worst alarm, HOLD ALL."""

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.screen import ModalScreen

from tui_gcs.actions import APP
from tui_gcs.core.protocol.common import RunPhase
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import FleetUpdated, NoticeChanged, StationBack, StationLost, StatusUpdated
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import wrapped
from tui_gcs.widgets.basics.top_lines import worst

# The size of a plain terminal, also over SSH.
MIN_COLUMNS, MIN_ROWS = 80, 24


class TinyLines(LinesView):
    """The few lines that the screen has room for."""

    DEFAULT_CSS = "TinyLines { width: 1fr; height: 1fr; }"

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE) -> None:
        super().__init__(glyphs=glyphs)
        self._feed = feed
        self._prompt = ""

    def set_prompt(self, text: str) -> None:
        """Show what waits for the next key; "" if nothing does."""
        self._prompt = text
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """Return the most important lines first: they may be all that fits."""
        status = self._feed.status
        alarm = worst(self._feed)
        lines: list[Line] = []
        if self._prompt:
            lines += [[(piece, Ink.SELECTED)] for piece in _wrapped(self._prompt, width)]
        elif self._feed.notice.text:  # what became of the last command
            lines += [[(piece, Ink.BOLD)] for piece in _wrapped(self._feed.notice.text, width)]
        if alarm.text:
            lines += [[("!", Ink.ALARM), (" " + piece, Ink.WARNING)] for piece in _wrapped(alarm.text, width - 2)]
        if status is not None and not self._feed.station_lost:
            lines.append([(f"{status.kind} {status.heard}/{status.vehicles} armed {status.armed}", Ink.BOLD)])
            lines.append([(f"{status.run}", Ink.TEXT)])
        lines.append([("!h HOLD ALL  q leave", Ink.BOLD)])
        size = self.app.size
        lines.append([(f"need {MIN_COLUMNS}x{MIN_ROWS}, this is {size.width}x{size.height}", Ink.MUTED)])
        return lines


class TinyScreen(ModalScreen[None]):
    """Covers every other screen while the terminal is too small."""

    DEFAULT_CSS = "TinyScreen { background: #101418; }"
    BINDINGS = [("q", "app.detach", "detach"), Binding("space", "hold_in_flight", "HOLD", id=f"{APP}.start_stop")]

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE) -> None:
        super().__init__()
        self._feed = feed
        self.tiny_lines = TinyLines(feed, glyphs=glyphs)

    def compose(self) -> ComposeResult:
        """Compose the lines, which fill the terminal."""
        yield self.tiny_lines

    async def action_hold_in_flight(self) -> None:
        """Hold while vehicles fly. On the ground Space does nothing: the operator would start what is not seen."""
        # What would start is not seen here, so the key that starts and stops only stops.
        if self._feed.status is not None and self._feed.status.run is not RunPhase.IDLE:
            await self.run_action("app.command('start_stop')")

    def on_mount(self) -> None:
        """Begin to receive the feed's messages."""
        self._feed.listen(self)

    @on(StatusUpdated)
    @on(NoticeChanged)
    @on(FleetUpdated)
    @on(StationLost)
    @on(StationBack)
    def _show(self) -> None:
        self.tiny_lines.update_lines()


def _wrapped(text: str, width: int) -> list[str]:
    return wrapped(text, width)[:3]
