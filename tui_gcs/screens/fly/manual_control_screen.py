"""Manual control: arrows fly the selected vehicles.

A terminal does not report that a key was released. Therefore the station flies each press for one second, and a
vehicle for which no other press follows stops. The guard checks this course like any other.
"""

from collections.abc import Callable

from textual import events
from textual.app import ComposeResult
from textual.screen import ModalScreen

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.common import Hold, Request, Vec3
from tui_gcs.core.protocol.flight import Nudge
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import FleetUpdated
from tui_gcs.screens.common.text_dialog import DialogBox
from tui_gcs.screens.orders.vehicle_words import now_words, rows_of
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink

DIRECTIONS: dict[str, Vec3] = {
    "up": (0.0, 1.0, 0.0),
    "k": (0.0, 1.0, 0.0),
    "down": (0.0, -1.0, 0.0),
    "j": (0.0, -1.0, 0.0),
    "left": (-1.0, 0.0, 0.0),
    "h": (-1.0, 0.0, 0.0),
    "right": (1.0, 0.0, 0.0),
    "l": (1.0, 0.0, 0.0),
    "plus": (0.0, 0.0, 0.5),
    "equals_sign": (0.0, 0.0, 0.5),
    "pageup": (0.0, 0.0, 0.5),
    "minus": (0.0, 0.0, -0.5),
    "pagedown": (0.0, 0.0, -0.5),
}
"""Direction (east, north, up) by key; heights change at half the speed."""
GAP_S = 0.2
"""The least time between two requests: a key that is held down repeats faster than a link should carry."""
SPEEDS_M_S = (0.5, 1.0, 2.0, 4.0)
"""The speeds that brackets choose from."""
TIMEOUT_S = 10.0
"""The screen closes this long after the last key, so that another person does not find it open."""


class ManualControlScreen(ModalScreen[None]):
    """A box at the map's lower edge while keys move the vehicles."""

    closed_by_itself = ""
    """Why no key closed it, see `TextDialog`."""
    DEFAULT_CSS = """
    ManualControlScreen { align: center bottom; background: #101418 0%; }
    ManualControlScreen DialogBox { margin: 0 0 1 0; }
    """

    def __init__(
        self,
        vehicles: tuple[int, ...],
        feed: Feed,
        ask: Callable[[Request], None],
        hold: Callable[[Hold, str], None],
        clock: Clock,
        glyphs: GlyphSet,
    ) -> None:
        """Fly `vehicles`; `ask` sends a request, `hold` sends one that is followed until telemetry confirms it."""
        super().__init__()
        self._vehicles = vehicles
        self._feed = feed
        self._ask = ask
        self._hold = hold
        self._clock = clock
        self._speed = 1
        self._sent_s = self._key_s = clock.now()
        self._problem = ""
        self.box = DialogBox(glyphs=glyphs)

    def compose(self) -> ComposeResult:
        """Compose the box at the lower edge."""
        yield self.box

    def on_mount(self) -> None:
        """Begin to receive the feed's messages."""
        self._feed.listen(self)
        self.set_interval(0.5, self.tick)
        self.redraw()

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        """Show where the vehicles are."""
        self.redraw()

    def tick(self) -> None:
        """Close when no key was pressed for `TIMEOUT_S`."""
        if self._clock.now() - self._key_s > TIMEOUT_S and self.is_current:
            self.closed_by_itself = f"flying by hand has ended: no key for {TIMEOUT_S:.0f} s"
            self.dismiss(None)

    def refuse(self, why: str) -> None:
        """Show why the station refused the last press."""
        self._problem = why
        self.redraw()

    def on_key(self, event: events.Key) -> None:
        """Move by arrows and + -, change the speed by brackets, hold by Space, leave by Esc."""
        event.stop()
        # A key may still come while the screen closes.
        if not self.is_current:
            return
        self._key_s = now = self._clock.now()
        if event.key in ("escape", "enter", "q"):
            self.dismiss(None)
        elif event.key == "space":
            # As an order that is followed until telemetry confirms it: the last press alone would end after a second.
            self._hold(Hold(vehicles=self._vehicles), f"hold {ids(self._vehicles)}")
            self.dismiss(None)
        elif event.character in ("[", "]"):
            step = 1 if event.character == "]" else -1
            self._speed = max(0, min(self._speed + step, len(SPEEDS_M_S) - 1))
            self.redraw()
        elif event.key in DIRECTIONS and now - self._sent_s >= GAP_S:
            self._sent_s = now
            self._problem = ""
            speed = SPEEDS_M_S[self._speed]
            east, north, up = (part * speed for part in DIRECTIONS[event.key])
            self._ask(Nudge(self._vehicles, (east, north, up)))

    def redraw(self) -> None:
        """Show the vehicles and the keys."""
        rows = rows_of(self._feed)
        lines: list[Line] = [[(f"{v:<4} ", Ink.BOLD), (now_words(rows.get(v)), Ink.TEXT)] for v in self._vehicles[:4]]
        keys = f"arrows: north south west east   + -: up down   [ ]: {SPEEDS_M_S[self._speed]:g} m/s"
        lines += [
            [(self._problem, Ink.CAUTION)] if self._problem else [(keys, Ink.BOLD)],
            [(" Space = HOLD ", Ink.SELECTED), ("  Esc = done   they stop 1 s after the last key", Ink.MUTED)],
        ]
        self.box.show(f"by hand: {ids(self._vehicles)}", lines)

    def text(self) -> str:
        """Return the text of the box."""
        return self.box.text()
