"""Checks of an address before a link or a forwarding partner is opened there."""

from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.core.links import Link, LinkError, open_link, parse_link, try_links
from tui_gcs.core.links.overlaps import led_into, same_place
from tui_gcs.core.links.spec import LinkSpec, is_loopback, is_number
from tui_gcs.core.requests.links.changes import refuse
from tui_gcs.core.station.assembly import StationParts


def parsed(text: str) -> LinkSpec:
    """Return the link that was typed. Raises `LinkRefusedError`."""
    try:
        return parse_link(text)
    except LinkError as error:
        refuse(clean(str(error), 300))


def opened(spec: LinkSpec, parts: StationParts, *, must_work: bool) -> Link:
    """Open a link. With `must_work` it is refused where there is no device or no way to its address just now.

    At the start of a station a link is opened all the same: its device or network may come back.

    Raises:
        LinkRefusedError: it cannot be opened; one line with what to do.
    """
    try:
        if must_work:
            try_links([spec])
        return open_link(spec, parts.records.clock)
    except LinkError as error:
        refuse(clean(str(error), 300))


def check_address(spec: LinkSpec, parts: StationParts) -> None:
    """Check that this station may open a link or a partner there. Raises `LinkRefusedError`."""
    if spec.scheme == "replay":
        refuse("a recording is no link of a running station: tui-gcs replay shows it")
    if spec.network not in parts.picture.fleet.intakes:
        refuse(f"no link had network {spec.network!r} when the station began: start it with that link")
    if parts.config.kind is RunKind.SIM and not is_loopback(spec.host):
        refuse("a SIM station takes links of this machine only (127.0.0.1)")
    # Looking a name up may take seconds, in which the station would do nothing else.
    if spec.host and not is_number(spec.host):
        refuse(f"{clean(spec.host, 60)} is a name: give the number of the address")
    links = [link.spec for link in parts.comms.links.values() if not link.is_closed]
    partners = [port.link.spec for port in parts.comms.forwarder.ports if not port.is_closed]
    _check_free(spec, links, "a link to vehicles")
    _check_free(spec, partners, "forwarded to")
    if name := led_into(spec, [*links, *partners]):
        refuse(f"{spec.name} and {name} lead into each other: what vehicles send would come back; take another port")


def _check_free(spec: LinkSpec, others: list[LinkSpec], use: str) -> None:
    for other in others:
        if same_place(spec, other):
            known = spec.name if spec.name == other.name else f"{spec.name} ({other.name})"
            refuse(f"{known} is {use} already")
