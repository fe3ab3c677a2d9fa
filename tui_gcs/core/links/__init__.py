"""Links: sockets, serial lines, log files and memory as one kind of link to vehicles.

Bytes come in with the address of their sender and go out to an address. `open_link` makes a `base.Link` from the
operator's text (`spec.parse_link`); the station's reception calls `receive` and the uplink `send`. Nothing blocks, and
nothing raises after opening: trouble is in `error`, losses are counted. Links reconnect by themselves, driven by
`receive` and the injected clock. The kinds are `udp`, `tcp`, `tcp_server`, `serial`, `replay` and `memory`;
`send_queue`, `reconnect_timer`, `resolve` and `tcp_connection` are shared parts. Not here: frames and messages
(core/mavlink), which path a vehicle uses (core/fleet).
"""

from collections.abc import Callable
from contextlib import ExitStack

from tui_gcs.core.base.clock import Clock, MonotonicClock
from tui_gcs.core.links.base import Link
from tui_gcs.core.links.replay import ReplayLink
from tui_gcs.core.links.resolve import ResolvedAddress, resolve
from tui_gcs.core.links.serial import SerialLink, open_device
from tui_gcs.core.links.spec import LinkError, LinkSpec, parse_link
from tui_gcs.core.links.tcp import TcpLink
from tui_gcs.core.links.tcp_server import TcpInLink
from tui_gcs.core.links.udp import UdpInLink, UdpOutLink

__all__ = ["Link", "LinkError", "LinkSpec", "open_link", "parse_link", "try_links"]

_BY_SCHEME: dict[str, Callable[[LinkSpec, ResolvedAddress, Clock], Link]] = {
    "udpin": UdpInLink,
    "udpout": UdpOutLink,
    "tcpin": TcpInLink,
    "tcp": TcpLink,
}
"""Kinds of links to a host and port."""


def open_link(link: LinkSpec | str, clock: Clock | None = None) -> Link:
    """Return the link that is meant by e.g. "udpin:127.0.0.1:14550"; see `parse_link`.

    `tcp` and `serial` links open with the first `receive`, and again whenever their partner has been away. A missing
    partner is no error here, because a restarted station must come up without it; `try_links` reports it.

    Raises:
        LinkError: not such a name, unknown host, busy port, unreadable file; one line with what to do.
    """
    spec = parse_link(link) if isinstance(link, str) else link
    clock = clock or MonotonicClock()
    if spec.scheme == "serial":
        return SerialLink(spec, clock)
    if spec.scheme == "replay":
        return ReplayLink(spec, clock)
    if spec.scheme in _BY_SCHEME:
        return _BY_SCHEME[spec.scheme](spec, resolve(spec), clock)
    raise LinkError(f"{spec.name}: a {spec.scheme!r} link cannot be opened")


def try_links(specs: list[LinkSpec]) -> None:
    """Open all links together, also those that `open_link` opens later, and close them again.

    Raises:
        LinkError: one cannot be opened; one line with what to do.
    """
    with ExitStack() as opened:
        for spec in specs:
            if spec.scheme == "serial":
                try:
                    opened.callback(open_device(spec).close)
                except LinkError as error:
                    raise LinkError(f"{spec.name}: {error}") from None
                continue
            link = open_link(spec)
            opened.callback(link.close)
            if spec.scheme == "udpout" and link.error:
                raise LinkError(f"{spec.name}: {link.error}. Check the address and this machine's network")
