"""Links on the bus: part of `StationStatus`."""

from tui_gcs.core.protocol.base import Message


class LinkStatus(Message, frozen=True):
    """A link as the operator sees it."""

    name: str
    up: bool
    datagrams: int
    frames: int
    bad: int
    """Bytes that belonged to no valid frame."""
    error: str = ""
    network: str = ""
    bad_crc: int = 0
    """Whole frames with a wrong CRC."""
    kernel_drops: int = 0
    """Datagrams that the system threw away because we did not read in time."""
    send_refused: int = 0
    """Frames that could not be sent."""
    bytes_in: int = 0
    bytes_out: int = 0
    radio: str = ""
    """The radio's own report in one line; empty without a radio."""
