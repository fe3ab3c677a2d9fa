"""The message inspector on the bus: what every sender sends, the fields of one message, and a rate for it.

Part of `core/protocol/services.py`. Nothing is collected for it: the answer is made of what the intake holds anyway, so
that nothing is spent while no console asks, and nothing remains of a console that went away. Rates follow from the
counts of two answers.
"""

from tui_gcs.core.mavlink.field_meanings import FieldValue
from tui_gcs.core.protocol.base import Message, Request, VehicleRequest, Vehicles

MAX_ROWS = 1000
"""Rows of one answer: 50 vehicles with 20 kinds of messages each. A row takes 9 µs of the station's tick."""
MAX_SOURCES = 200
"""Senders' addresses in one answer."""
MAX_VALUES = 128
"""Values in one answer: a picture has at most eight curves in each of six panes."""
MAX_RATE_HZ = 200.0
"""Autopilots send nothing faster than their main loop; ArduPilot keeps intervals in whole milliseconds."""


class MessageKey(Message, frozen=True):
    """One kind of message of one component, as it comes over one path."""

    network: str
    link: str
    address: str
    system: int
    component: int
    msgid: int


class MessageRow(Message, frozen=True):
    """What is known of one kind of message without decoding it."""

    key: MessageKey
    name: str
    """MAVLink's name; "UNKNOWN_" and the number where the dialect does not know it."""
    vehicle: int
    """The vehicle of that system id; 0: none that is known."""
    count: int
    """Frames since the station began, or since the path was judged anew."""
    age_s: float
    size: int
    """Bytes of the newest whole frame."""
    signed: bool
    version: int
    """MAVLink 1 or 2."""
    autopilot: bool
    """Its component is the one that the station takes for the autopilot."""
    used: bool
    """Its frames count; False: they come over a path that is not accepted, or from no vehicle."""


class FieldRow(Message, frozen=True):
    """One field of the newest frame."""

    name: str
    type: str
    """As the dialect has it, e.g. `uint16_t[4]`."""
    value: FieldValue


class MessageDetail(Message, frozen=True):
    """The newest frame of one kind of message."""

    key: MessageKey
    fields: tuple[FieldRow, ...]
    """In wire order; empty where the dialect does not know the message."""
    raw: bytes
    """The whole frame without its signature; empty where it holds a key."""
    remark: str = ""
    """Why something is not shown."""


class SourceRow(Message, frozen=True):
    """One address that sends, and what of it could not be used."""

    network: str
    link: str
    address: str
    vehicles: int
    """How many vehicles are accepted from there."""
    frames: int
    junk_bytes: int
    """Bytes that belonged to no frame."""
    text_bytes: int
    """Plain text, e.g. a boot banner."""
    bad_crc: int
    """Whole frames with a wrong CRC."""
    bad_crc_names: tuple[str, ...]
    """The messages that most of those claimed to be, with their numbers."""
    version1_refused: int
    """MAVLink 1 frames after MAVLink 2: a downgrade."""


class Inspection(Message, frozen=True):
    """What is received, at one moment."""

    t_s: float
    rows: tuple[MessageRow, ...]
    sources: tuple[SourceRow, ...]
    left_out: int = 0
    """Kinds of messages beyond `MAX_ROWS`."""
    detail: MessageDetail | None = None


class GetMessages(Request, frozen=True, tag="get-messages"):
    """What these vehicles send, or everything that is received (`ServiceReply.inspection`)."""

    vehicles: Vehicles = ()
    detail: MessageKey | None = None
    """The message whose newest frame is wanted, too."""


class ValueKey(Message, frozen=True):
    """One number that a vehicle has sent: a field of a message, or a parameter."""

    vehicle: int
    name: str
    """`ATTITUDE.roll`, `BATTERY_STATUS.voltages[0]`, or the name of a parameter."""
    is_parameter: bool = False


class ValueRow(Message, frozen=True):
    """The newest value of a key; NaN where it was not received."""

    t_s: float
    """When it arrived, in station time; of a parameter: now."""
    value: float
    """In MAVLink's own scaling."""


class GetValues(Request, frozen=True, tag="get-values"):
    """The newest values of these keys, in their order (`ServiceReply.values`); for curves over time."""

    keys: tuple[ValueKey, ...]


class SetMessageRate(VehicleRequest, frozen=True, tag="set-message-rate"):
    """Have vehicles' autopilots send a message at a rate, until it is given back or the station ends."""

    msgid: int
    rate_hz: float | None
    """0: not at all. None: give it back, so that the station's own set of messages decides again."""
    sure: bool = False
    """Also where it does not fit into the budget of the link, or takes away what the station flies by."""
