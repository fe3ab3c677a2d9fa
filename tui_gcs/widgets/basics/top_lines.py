"""The lines that every screen begins with: status, and the worst alarm with the key that answers it.

Over a replay a third one shows the stations that fly meanwhile.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from textual import on
from textual.app import ComposeResult
from textual.containers import Vertical

from tui_gcs.actions import APP_ACTIONS, ConsoleAction
from tui_gcs.actions.action import on_screen
from tui_gcs.core.protocol.alarms import action_words
from tui_gcs.core.protocol.common import Phase, StationStatus
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import FleetUpdated, NoticeChanged, StationBack, StationLost, StatusUpdated
from tui_gcs.feed.notices import ALARM_SEVERITIES, Notice, Severity
from tui_gcs.widgets.basics.alarm_line import AlarmLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.live_line import LiveLine
from tui_gcs.widgets.basics.shown_keys import KEYS
from tui_gcs.widgets.basics.status_line import StatusLine

START_LIMIT_S = 15.0
"""A station that is being started answers within this time (`client.launcher`)."""


class TopLines(Vertical):
    """Status line and alarm line; they follow the feed by themselves."""

    DEFAULT_CSS = """
    TopLines { height: 2; dock: top; }
    TopLines.-live { height: 3; }
    """

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE) -> None:
        """Follow this feed once mounted."""
        super().__init__()
        self._feed = feed
        self.status_line = StatusLine(glyphs=glyphs)
        self.alarm_line = AlarmLine(glyphs=glyphs)
        self.live_line = LiveLine(glyphs=glyphs)

    def compose(self) -> ComposeResult:
        """See `Widget`: the status line stands above the alarm line, what flies beside a replay below it."""
        yield self.status_line
        yield self.alarm_line
        yield self.live_line

    def on_mount(self) -> None:
        """Subscribe to the feed, and show what is known already."""
        self._feed.listen(self)
        self.alarm_line.set_notice(self._feed.notice)
        self.on_live_news_changed()
        self.show()

    def on_notice_changed(self, _message: NoticeChanged) -> None:
        """Show what the operator is notified of now."""
        self.alarm_line.set_notice(self._feed.notice)

    def on_live_news_changed(self) -> None:
        """Show what flies while this is a replay; the line is not there where nothing does."""
        self.set_class(bool(self._feed.live.text), "-live")
        self.live_line.show(self._feed.live)

    @on(StatusUpdated)
    @on(FleetUpdated)
    @on(StationLost)
    @on(StationBack)
    def show(self) -> None:
        """Show everything anew; only what changed is written."""
        feed = self._feed
        wall_s = feed.frame.wall_s if feed.frame is not None else math.nan
        holds = feed.frame is None or Phase.HOLDING in feed.frame.phase
        self.status_line.show(
            feed.status, wall_s=wall_s, principal=feed.requests.principal, lost=feed.station_lost, holds=holds
        )
        alarms = feed.status.alarms if feed.status is not None else ()
        self.alarm_line.set_alarms(alarms, self._keys(), local_notice(feed))

    def _keys(self) -> dict[str, str]:
        """The keys of actions as they are reached from this screen."""
        own: Sequence[ConsoleAction] = getattr(self.screen, "ACTIONS", ())
        everywhere = [replace(action, shown=KEYS.get(action.id, "")) for action in APP_ACTIONS]
        return KEYS | {action.id: action.shown for action in on_screen(everywhere, own) if action.shown}


def local_notice(feed: Feed) -> Notice:
    """What only this console can know: its station is silent, or it may not command."""
    if feed.station_lost:
        if feed.status is None and feed.starts_station and feed.silent_s < START_LIMIT_S:
            return Notice(f"the station is being started, {feed.silent_s:.0f} s so far", Severity.CAUTION)
        return station_lost_notice(feed.status, feed.silent_s)
    return Notice(feed.requests.read_only)


def worst(feed: Feed) -> Notice:
    """The most important notice, where there is room for one alone."""
    if feed.live.level >= Severity.CAUTION:
        return Notice(f"NOW {feed.live.text}  q leaves the replay", feed.live.level)
    local = local_notice(feed)
    alarms = feed.status.alarms if feed.status is not None else ()
    first = alarms[0] if alarms and alarms[0].state != "shelved" else None
    if first is None or local.level is Severity.WARNING:
        return local
    return Notice(f"{first.words()}  {action_words(first.action, KEYS)}", ALARM_SEVERITIES[first.level])


def station_lost_notice(status: StationStatus | None, silent_s: float) -> Notice:
    """What a silent station means, and what to do."""
    if status is None:
        return Notice(
            f"no station heard for {silent_s:.0f} s: is it running?  q leaves; then tui-gcs fly", Severity.WARNING
        )
    if status.ending:
        return Notice("the station was ended: q leaves; tui-gcs fly or demo starts one", Severity.CAUTION)
    return Notice(
        f"station silent for {silent_s:.0f} s   !h tries HOLD ALL   vehicles go on as set up",
        Severity.WARNING,
    )
