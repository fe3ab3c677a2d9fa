"""The dialog that changes the round, on the ground or in flight."""

from collections.abc import Sequence

from textual import events

from tui_gcs.core.base.clock import Clock, MonotonicClock
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.text_dialog import LINE_CELLS, TextDialog
from tui_gcs.screens.fly.start_dialog import CANCEL_AFTER_S, CHANGED, CHECK_S
from tui_gcs.screens.orders.order_dialog import NO_KEY
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink


class RoundDialog(TextDialog[int | None]):
    """Chooses a round by number or arrows. On the ground Enter switches to it; in flight `y`: all vehicles fly there.

    The dialog closes by itself like `StartDialog`.
    """

    title_text = "round"

    def __init__(
        self,
        rounds: Sequence[str],
        current: int,
        flying: bool,
        feed: Feed,
        glyphs: GlyphSet,
        clock: Clock | None = None,
    ) -> None:
        """Offer `rounds`; the one after the current is marked first."""
        super().__init__(glyphs)
        self._feed = feed
        self._clock = clock or MonotonicClock()
        self._seen = _round_now(feed)
        self._deadline_s = self._clock.now() + CANCEL_AFTER_S
        self._rounds = rounds
        self._current = current
        rows = feed.frame.rows() if flying and feed.frame is not None else []
        self._flying = [row.id for row in rows if row.armed and row.team]
        self._problem = ""
        self._marked = (current + 1) % len(rounds)

    def on_mount(self) -> None:
        """Watch time and station while the dialog is open."""
        super().on_mount()
        self.set_interval(CHECK_S, self.tick)

    def tick(self) -> None:
        """Cancel when time is up or what is shown has changed."""
        if _round_now(self._feed) != self._seen:
            self.lapse(None, CHANGED)
        elif self._clock.now() >= self._deadline_s:
            self.lapse(None, NO_KEY)
        else:
            self.redraw()

    def on_key(self, event: events.Key) -> None:
        """Choose by digits and arrows, confirm by Enter or y, leave by Esc.

        A question that is too old takes no answer.
        """
        event.stop()
        self.tick()
        if self.closed_by_itself:
            return
        self._deadline_s = self._clock.now() + CANCEL_AFTER_S
        self._problem = ""
        if event.key == "escape":
            self.finish(None)
        # In flight the switch moves the whole fleet at once: Enter, which is pressed by habit, does not do it.
        elif event.key == ("y" if self._flying else "enter"):
            self.finish(self._marked)
        elif event.key == "enter":
            self._problem = "press y: they fly there at once"
            self.redraw()
        elif event.key in ("down", "j", "o"):
            self._mark(self._marked + 1)
        elif event.key in ("up", "k"):
            self._mark(self._marked - 1)
        elif (
            event.character is not None and event.character.isdigit() and 0 < int(event.character) <= len(self._rounds)
        ):
            self._mark(int(event.character) - 1)

    def _mark(self, index: int) -> None:
        self._marked = index % len(self._rounds)
        self.redraw()

    def body(self) -> list[Line]:
        """Return the rounds, the vehicles that would fly there, and the keys."""
        lines: list[Line] = []
        for index, name in enumerate(self._rounds):
            mark = self.glyphs.selected if index == self._marked else " "
            now = "   now" if index == self._current else ""
            ink = Ink.BOLD if index == self._marked else Ink.TEXT
            lines.append([(f"{mark} {index + 1}  {name}{now}", ink)])
        what = f"fly there at once: {ids(self._flying)}" if self._flying else "nothing flies"
        yes = "y = switch" if self._flying else "Enter = switch"
        left_s = max(0, round(self._deadline_s - self._clock.now()))
        keys: Line = [(f" Esc = cancel ({left_s} s) ", Ink.SELECTED), (f"   {yes}   number, arrows: another", Ink.BOLD)]
        return [*lines, [], [(what[:LINE_CELLS], Ink.TEXT)], [(self._problem, Ink.CAUTION)], keys]


def _round_now(feed: Feed) -> object:
    """Return a value that changes when the question is void."""
    status = feed.status
    state = (status.rounds, status.round_index, status.run, status.revision) if status is not None else ()
    return state, feed.station_lost, feed.requests.read_only
