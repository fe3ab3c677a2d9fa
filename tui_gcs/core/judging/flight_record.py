"""Records of single events of a flight that count for its result: an intruder met, a task done."""

import msgspec


class RecordedEvent(msgspec.Struct):
    """One thing that happened once."""

    t_s: float
    """Mission time: seconds since the start of the flight."""
    round: str
    kind: str
    """What happened, e.g. "intruder met", "intruder in the zone", "task done"."""
    subject: str
    """Whom or what it was about, e.g. the number of an intruder or the name of a task."""
    vehicle: int | None = None
    """The vehicle that did it; None where none did, or it is not known."""
    text: str = ""
