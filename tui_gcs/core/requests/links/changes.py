"""How a change of links or partners is refused, kept for later starts, and reported where it cannot be made again."""

from collections.abc import Callable
from typing import NoReturn

from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.common import EventClass, Reply
from tui_gcs.core.records.event_log import WARNING
from tui_gcs.core.records.link_store import LinkStore
from tui_gcs.core.station.assembly import StationParts


class LinkRefusedError(Exception):
    """Why a link or a partner is not changed, in one line for the operator."""


def refuse(why: str) -> NoReturn:
    """Raise `LinkRefusedError`."""
    raise LinkRefusedError(why)


def reply_of(change: Callable[[], str]) -> Reply:
    """Return the reply to a change: what was done, or why it was refused."""
    try:
        return Reply(ok=True, text=change())
    except LinkRefusedError as error:
        return Reply(ok=False, text=str(error))


def keep(store: LinkStore | None, change: Callable[[LinkStore], None]) -> str:
    """Keep a change for a restart; return what the operator must know about that, to follow what was done."""
    if store is None:
        return ""
    change(store)
    return f"; NOT kept for a restart: {clean(store.error, 200)}" if store.error else ""


def keep_added(store: LinkStore | None, change: Callable[[LinkStore], None]) -> str:
    """Keep what was added; the operator must know if it ends with this run."""
    ends = "; until this SIM station is ended" if store is not None and not store.keeps_added else ""
    return keep(store, change) or ends


def make_again(parts: StationParts, complaint: str, change: Callable[[], object], forgets: str = "") -> bool:
    """Make an earlier change again at the start of a station; return whether it could be made.

    Else one event begins with `complaint` and says why; `forgets` is the command that ends the attempts.
    """
    try:
        change()
    except LinkRefusedError as error:
        advice = f"; {forgets} forgets it" if forgets else ""
        report_event(parts, f"{complaint}: {clean(str(error), 150)}{advice}")
        return False
    return True


def report_event(parts: StationParts, text: str, severity: int = WARNING) -> None:
    """Report what became of an earlier change at the start of a station."""
    parts.records.events.report(EventClass.CONNECTION, "station", clean(text, 300), severity)
