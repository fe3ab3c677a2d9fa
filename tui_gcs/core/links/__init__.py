"""Links: how bytes reach vehicles. `open_link` makes one from what the operator wrote."""

from tui_gcs.core.clock import Clock, MonotonicClock
from tui_gcs.core.links.base import Address, Link
from tui_gcs.core.links.replay import ReplayLink
from tui_gcs.core.links.resolve import resolve
from tui_gcs.core.links.serial import SerialLink, open_device
from tui_gcs.core.links.spec import LinkError, LinkSpec, parse_link
from tui_gcs.core.links.tcp import TcpLink
from tui_gcs.core.links.tcpin import TcpInLink
from tui_gcs.core.links.udp import UdpInLink, UdpOutLink

__all__ = ["Address", "Link", "LinkError", "LinkSpec", "check_link", "open_link", "parse_link"]


def open_link(link: LinkSpec | str, clock: Clock | None = None) -> Link:
    """The link that is meant, e.g. by "udpin:127.0.0.1:14550"; see `parse_link`.

    `tcp` and `serial` links open with the first `receive`, and again whenever their partner has been away.

    Raises:
        LinkError: not such a name, unknown host, busy port, unreadable file; one line with what to do.
    """
    spec = parse_link(link) if isinstance(link, str) else link
    clock = clock or MonotonicClock()
    if spec.scheme == "serial":
        return SerialLink(spec, clock)
    if spec.scheme == "replay":
        return ReplayLink(spec, clock)
    if spec.scheme == "udpin":
        return UdpInLink(spec, resolve(spec), clock)
    if spec.scheme == "udpout":
        return UdpOutLink(spec, resolve(spec), clock)
    if spec.scheme == "tcpin":
        return TcpInLink(spec, resolve(spec), clock)
    if spec.scheme == "tcp":
        return TcpLink(spec, resolve(spec), clock)
    raise LinkError(f"{spec.name}: a {spec.scheme!r} link cannot be opened")


def check_link(spec: LinkSpec) -> None:
    """Try whether the link can be opened now, and let go of it; also of a device, which `open_link` would wait for.

    Raises:
        LinkError: it cannot; one line with what to do.
    """
    if spec.scheme != "serial":
        open_link(spec).close()
        return
    try:
        open_device(spec).close()
    except LinkError as error:
        raise LinkError(f"{spec.name}: {error}") from None
