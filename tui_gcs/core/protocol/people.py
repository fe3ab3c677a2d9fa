"""Who is connected to the station, who holds control, and how it is handed over.

Control is held by the principal of the newest command; the next command of another console takes it. Principals come
from the bus key, presence from a liveliness token of the bus: neither is a field that a sender fills in.
"""

from tui_gcs.core.protocol.base import Message, Request


class PersonRow(Message, frozen=True):
    """A console, planner worker or script that is connected, or that has commanded."""

    principal: str
    is_present: bool
    present_s: float
    """For how long it has been connected; NaN if it is not."""
    is_in_control: bool
    last_command: str
    """Its newest command in words; empty: none since the station began."""
    last_command_age_s: float
    """NaN without a command."""


class GetPeople(Request, frozen=True, tag="get-people"):
    """Who is connected or has commanded (`ServiceReply.people`)."""


class HandOver(Request, frozen=True, tag="hand-over"):
    """Give control to another principal that is connected; refused unless the asker holds it, or nobody does."""

    to: str


class TakeControl(Request, frozen=True, tag="take-control"):
    """Hold control without commanding anything."""
