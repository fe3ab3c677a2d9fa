"""Links, paths and partners in detail, and changes of links while the station runs.

Part of `core/protocol/services.py`. `StationStatus.links` has what every console shows; this is asked for by the links
screen while it is shown.
"""

import math

from tui_gcs.core.protocol.base import Message, Request

MAX_PATHS = 2000


class RadioRow(Message, frozen=True):
    """The newest RADIO_STATUS of a link's radio, in the radio's own units (SiK: dBm = rssi / 1.9 - 127)."""

    txbuf_pct: int
    """Free share of its transmit buffer; above 100: it does not know."""
    rssi: int
    remote_rssi: int
    noise: int
    remote_noise: int
    rx_errors: int
    fixed: int
    """Packets that error correction saved."""
    age_s: float


class LinkRow(Message, frozen=True):
    """One link."""

    name: str
    network: str
    up: bool
    error: str
    capacity_bytes_per_s: int | None
    """What the link carries, both directions together; None: no limit is known."""
    telemetry_bytes_per_s: float
    """What the vehicles on it are asked to send, an upper bound."""
    budget_bytes_per_s: float | None
    """The share of the capacity for that."""
    set_name: str
    """The set of messages that its vehicles are asked for."""
    vehicles: int
    bytes_in: int
    bytes_out: int
    frames: int
    junk_bytes: int
    bad_crc: int
    kernel_drops: int
    """Datagrams that the system threw away because they were not read in time."""
    send_refused: int
    secure: bool
    """The operator vouches that it cannot be overheard."""
    high_latency: bool
    radio: RadioRow | None = None
    is_added: bool = False
    """An operator added it while a station ran; else it was given when this one was started."""
    is_kept: bool = False
    """Added links are opened again by later stations; else they are closed when this run ends."""


class PathRow(Message, frozen=True):
    """One path of one vehicle: an address on a link that brings frames with its system id."""

    vehicle: int
    link: str
    address: str
    state: str
    """`used`, or why it is not: `asked who it is`, `conflict`."""
    in_use: bool
    """Frames for the vehicle go this way."""
    heard_age_s: float
    frames: int
    loss_pct: float
    """Frames from the vehicle that were lost on the way to us, 0…100."""
    up_loss_pct: float
    """What the vehicle itself reports as lost on the way to it (SYS_STATUS.drop_rate_comm); NaN: nothing."""
    duplicates: int
    """Frames that another path had brought before."""
    restarts: int
    """How often the sequence numbers began elsewhere: reboots, or a second sender."""
    signing: str
    """What the signatures of the vehicle prove."""
    rtt_s: float = math.nan
    """The newest round trip; measured on the path in use only."""
    best_rtt_s: float = math.nan


class PartnerRow(Message, frozen=True):
    """Another station that gets our vehicles' frames."""

    endpoint: str
    takes_commands: bool
    """Its commands are judged and may reach vehicles."""
    up: bool
    error: str
    address: str
    """Empty: nobody is there, or the row has what came from senders that are no partners, or no more."""
    systems: tuple[str, ...]
    """System and component ids heard from it, `255/190`."""
    heard_age_s: float
    bytes_out: int
    """Of the endpoint, to all its partners."""
    refused: dict[str, int] = {}
    """Frames of this partner that were not passed on, by reason."""
    bytes_in: int = 0
    """Of the endpoint, from all its partners."""
    passed: int = 0
    """Frames of this partner that reached a vehicle."""
    is_closed: bool = False
    """An operator has closed the endpoint; `error` says who."""
    is_added: bool = False
    """An operator added it while a station ran; else it was given when this one was started."""
    is_kept: bool = False
    """Later stations forward there, too, and take no commands; else it is closed when this run ends."""


class LinkReport(Message, frozen=True):
    """All links at one moment."""

    t_s: float
    links: tuple[LinkRow, ...]
    paths: tuple[PathRow, ...]
    partners: tuple[PartnerRow, ...]
    passed: int
    """Frames of partners that reached a vehicle."""
    left_out: int = 0
    """Paths beyond `MAX_PATHS`."""


class GetLinks(Request, frozen=True, tag="get-links"):
    """The links, the vehicles' paths and forwarding partners (`ServiceReply.link_report`)."""


class AddLink(Request, frozen=True, tag="add-link"):
    """Open another link, or one that was closed; in LIVE it is kept for later starts."""

    link: str
    """As on the command line: `udpin:0.0.0.0:14551,rate=5000`."""


class CloseLink(Request, frozen=True, tag="close-link"):
    """Close a link; refused while a vehicle that is armed is heard over it alone."""

    name: str


class AddPartner(Request, frozen=True, tag="add-partner"):
    """Let another station hear the vehicles from now on."""

    link: str
    """As `--forward` takes it: `udpout:192.168.1.5:14550`, with `,network=NAME` where ids repeat."""
    takes_commands: bool = False
    """As `--forward-commands`: its commands are judged, and may reach vehicles."""


class ClosePartner(Request, frozen=True, tag="close-partner"):
    """Let another station neither hear the vehicles nor command them any more."""

    name: str
    """The endpoint: what was typed, without options."""


class SetLinkRate(Request, frozen=True, tag="set-link-rate"):
    """Change what a link is taken to carry; the vehicles' messages follow."""

    name: str
    bytes_per_s: int | None
    """None: no limit."""
