"""Messages that the feed posts to screens and widgets, at most five times a second; see `feed.Feed`."""

from textual.message import Message

from tui_gcs.core.protocol import common as wire


# None of them bubbles: the feed posts to every listener itself, and a message that bubbles to the app costs twice as
# much (docs/terminal.md B5).
class _NewestOnly(Message, bubble=False):
    """A message of which only the newest matters: it replaces one of its kind that is not handled yet."""

    def can_replace(self, message: Message) -> bool:
        """See `Message`."""
        return isinstance(message, type(self))


class FleetUpdated(_NewestOnly, bubble=False):
    """A fleet frame came in which something visible changed."""

    def __init__(self, frame: wire.FleetFrame) -> None:
        super().__init__()
        self.frame = frame


class StatusUpdated(_NewestOnly, bubble=False):
    """A station status came in which something visible changed."""

    def __init__(self, status: wire.StationStatus) -> None:
        super().__init__()
        self.status = status


class EventRaised(Message, bubble=False):
    """Events came; they are in order, oldest first, and none is missing."""

    def __init__(self, events: tuple[wire.JournalEvent, ...]) -> None:
        super().__init__()
        self.events = events


class EventsForgotten(Message, bubble=False):
    """A replay went back in time: all events so far are no longer true; those that are follow."""


class ScenarioUpdated(Message, bubble=False):
    """The station flies another scenario, or another version of it."""

    def __init__(self, change: wire.ScenarioChanged) -> None:
        super().__init__()
        self.change = change


class PlannerUpdated(Message, bubble=False):
    """The planners draw something else; `annotations` are by team."""

    def __init__(self, annotations: dict[str, tuple[wire.Annotation, ...]]) -> None:
        super().__init__()
        self.annotations = annotations


class SelectionChanged(_NewestOnly, bubble=False):
    """Other vehicles are selected, or another one of them is looked at: see `Feed.selection`."""


class VehicleInfoUpdated(_NewestOnly, bubble=False):
    """More is known of the vehicle looked at: see `VehicleInspection.info`."""


class NoticeChanged(_NewestOnly, bubble=False):
    """The operator is shown another notice, or none any more: see `Feed.notice`."""


class LiveNewsChanged(_NewestOnly, bubble=False):
    """Beside a replay: the news of the stations that fly have changed; see `Feed.live`."""


class StationLost(Message, bubble=False):
    """No status for three seconds; posted again each second while `Feed.silent_s` grows."""


class StationBack(Message, bubble=False):
    """The station is heard again, or was restarted."""


class DisplayLagged(Message, bubble=False):
    """The terminal had stopped reading; what is shown now is fresh again."""
