"""Events on the bus: new ones as they happen, older ones from the station's journal."""

from enum import StrEnum

from tui_gcs.core.protocol.base import Message, Request

JOURNAL_END = -1


class EventClass(StrEnum):
    """The paper's three classes of error, and the things that are not errors."""

    CONNECTION = "connection"
    SENSOR = "sensor"
    PROCESSING = "processing"
    OPERATOR = "operator"
    PLANNER = "planner"
    MISSION = "mission"
    VEHICLE = "vehicle"
    ALARM = "alarm"
    """Raised, acknowledged, over: the alarms' history."""
    CONSOLE = "console"
    """A message that a console showed to its operator."""


class JournalEvent(Message, frozen=True):
    """Something that happened. `seq` has no gaps: a console that sees one asks for what it missed."""

    seq: int
    t_s: float
    wall_s: float
    cls: EventClass
    severity: int
    """MAV_SEVERITY: 0 emergency … 4 warning, 5 notice, 6 info, 7 debug."""
    source: str
    text: str


class GetEvents(Request, frozen=True, tag="get-events"):
    """Events with seq > `after` (`Reply.events`), newest 500 at most."""

    after: int


class GetJournal(Request, frozen=True, tag="get-journal"):
    """Events of the station's journal that lie before a place in it, of earlier starts of the station, too.

    A piece of the file is looked at: the reply has its events, oldest first, perhaps none (`Reply.events`), and where
    the next older piece ends (`Reply.journal_at`; 0: there is none).
    """

    before: int = JOURNAL_END


class Note(Request, frozen=True, tag="note"):
    """Write a message that a console showed to its operator into the journal. It commands nothing."""

    text: str
    severity: int
