"""The two lines every screen begins with: status, and the worst alarm with the key that answers it."""

import math

from textual.app import ComposeResult
from textual.containers import Vertical

from tui_gcs.core.messages import StationStatus
from tui_gcs.feed import Feed, FleetUpdated, StationBack, StationLost, StatusUpdated
from tui_gcs.widgets.alarm_line import AlarmLine, Notice, worst_of
from tui_gcs.widgets.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.levels import Level
from tui_gcs.widgets.status_line import StatusLine


class TopLines(Vertical):
    """Status line and alarm line; listens to the feed itself."""

    DEFAULT_CSS = "TopLines { height: 2; dock: top; }"

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE) -> None:
        """For this feed."""
        super().__init__()
        self._feed = feed
        self.status_line = StatusLine(glyphs=glyphs)
        self.alarm_line = AlarmLine(glyphs=glyphs)

    def compose(self) -> ComposeResult:
        """Two lines."""
        yield self.status_line
        yield self.alarm_line

    def on_mount(self) -> None:
        """Listen, and show what is known already."""
        self._feed.listen(self)
        self.show()

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """New status."""
        self.show()

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        """New frame: clock and what it says about vehicles."""
        self.show()

    def on_station_lost(self, _message: StationLost) -> None:
        """No status for three seconds."""
        self.show()

    def on_station_back(self, _message: StationBack) -> None:
        """Heard again."""
        self.show()

    def show(self) -> None:
        """Everything anew; only what changed is written."""
        feed = self._feed
        wall_s = feed.frame.wall_s if feed.frame is not None else math.nan
        self.status_line.show(feed.status, wall_s=wall_s, principal=feed.principal, lost=feed.station_lost)
        self.alarm_line.set_alarm(worst(feed))


def worst(feed: Feed) -> Notice:
    """A silent station; its alarm; what this console sees in the frame; a reason for being read-only."""
    if feed.station_lost:
        return station_lost_notice(feed.status, feed.silent_s)
    seen = worst_of(feed.frame)
    if feed.status is not None and feed.status.alarm:
        return Notice(feed.status.alarm, Level.WARNING)
    if seen.text:
        return seen
    return Notice(feed.read_only, Level.CAUTION) if feed.read_only else seen


def station_lost_notice(status: StationStatus | None, silent_s: float) -> Notice:
    """What a silent station means, and what to do."""
    if status is None:
        return Notice(
            f"no station heard for {silent_s:.0f} s: is it running?  q leaves; then tui-gcs fly", Level.WARNING
        )
    return Notice(
        f"station silent for {silent_s:.0f} s: vehicles go on as set up for link loss   !h tries HOLD ALL",
        Level.WARNING,
    )
