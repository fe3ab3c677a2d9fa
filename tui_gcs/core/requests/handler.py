"""The entries of the request table: how one kind of request is answered, and what asking it means."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import Reply
from tui_gcs.core.protocol.services import MEANT, MEET
from tui_gcs.core.requests.tasks import Task


class Access(Enum):
    """Which principals may ask, and whether asking takes control of the fleet."""

    LOOK = "look"
    """Anyone, planner workers too; nothing is sent and nothing changes."""
    ASSIST = "assist"
    """Anyone but planner workers; no vehicle changes, so control stays where it is."""
    COMMAND = "command"
    """Anyone but planner workers; the asker is in control from now on."""


@dataclass(frozen=True)
class RequestHandler:
    """One entry of the request table."""

    access: Access
    answer: Callable[[str, Any], Reply]
    """Called with the principal and the request."""
    is_journalled: bool = True
    """Whether the router journals a COMMAND and its reply; False where the handler does so itself."""


@dataclass(frozen=True)
class VehicleAct:
    """How a request about vehicles is begun for one of them."""

    begin: Callable[[Vehicle, Any, Task], str]
    """Begins it and returns "", or returns why not. Raises `NotConfirmedError`."""
    words: Callable[[Any], str]
    """What is asked, for the operator and the journal."""


class NotConfirmedError(Exception):
    """A request is refused only until it is repeated with `sure` or `in_flight`."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"{reason}: {MEANT}")


class MissionsMeetError(NotConfirmedError):
    """A mission that would come too close to other vehicles is not begun unless the operator insists (`--meet`)."""

    def __init__(self, reason: str) -> None:
        Exception.__init__(self, f"{reason}: {MEET}")


def named(words: str) -> Callable[[Any], str]:
    """The same words for every request of a kind."""
    return lambda request: words
