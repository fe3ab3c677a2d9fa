"""Replay on the bus: how a recording is controlled, and where its player stands.

Only the player of `core/station/replay_player.py` answers `ControlReplay`; a station that flies refuses it as not
understood.
"""

from enum import StrEnum

from tui_gcs.core.protocol.base import Message, Request


class ReplayAct(StrEnum):
    """What `ControlReplay` does."""

    PAUSE = "pause"
    """Stand still, or go on."""
    FASTER = "faster"
    """Play at twice the speed."""
    SLOWER = "slower"
    """Play at half the speed."""
    MOVE = "move"
    """Go by a number of played seconds, forward or back (negative)."""
    GO_TO = "go to"
    """Go to a time in played seconds since the beginning."""
    NEXT_EVENT = "next event"
    PREVIOUS_EVENT = "previous event"
    NEXT_ALARM = "next alarm"
    PREVIOUS_ALARM = "previous alarm"


class ControlReplay(Request, frozen=True, tag="control-replay"):
    """Control the player of a recording; `Reply.text` is what it does now."""

    act: ReplayAct
    seconds: float = 0.0
    """For MOVE and GO_TO."""


class ReplayStatus(Message, frozen=True):
    """Where the player of a recording stands (`StationStatus.replay`)."""

    at_s: float
    """Played seconds since the beginning: long gaps of the recording are cut short."""
    length_s: float
    """Of the whole recording; NaN while it is being measured."""
    speed: float
    paused: bool
    searching: str = ""
    """What the player is on its way to; "" if it plays or stands still."""
    rewinds: int = 0
    """How often it went back: events and positions of before are no longer true then."""
    said: str = ""
    """What became of the last search, where nothing was found."""
