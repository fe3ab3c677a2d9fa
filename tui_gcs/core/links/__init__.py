"""Links: how bytes reach vehicles. `open_link` makes one from what the operator wrote."""

import socket

from tui_gcs.core.clock import Clock, MonotonicClock
from tui_gcs.core.links.base import Address, Link
from tui_gcs.core.links.spec import LinkError, LinkSpec, parse_link
from tui_gcs.core.links.tcp import TcpLink
from tui_gcs.core.links.udp import open_udpin, open_udpout

__all__ = ["Address", "Link", "LinkError", "LinkSpec", "open_link", "parse_link"]

_FORMS = "udpin:HOST:PORT, udpout:HOST:PORT or tcp:HOST:PORT"


def open_link(name: str, clock: Clock | None = None) -> Link:
    """The link `name`, e.g. "udpin:127.0.0.1:14550".

    Raises:
        LinkError: not such a name, unknown host, busy port; one line with what to do.
    """
    scheme, _, rest = name.partition(":")
    if scheme not in ("udpin", "udpout", "tcp"):
        raise LinkError(f"link {name!r}: unknown kind {scheme!r}; allowed: {_FORMS}")
    address = _resolve(name, rest)
    if scheme == "udpin":
        return open_udpin(name, address)
    if scheme == "udpout":
        return open_udpout(name, address)
    return TcpLink(name, address, clock or MonotonicClock())


def _resolve(name: str, rest: str) -> tuple[str, int]:
    """HOST:PORT as an IPv4 address and a port number."""
    host, separator, port_text = rest.rpartition(":")
    if not separator or not host or not (port_text.isascii() and port_text.isdigit()):
        raise LinkError(f"link {name!r}: not HOST:PORT; allowed: {_FORMS}")
    port = int(port_text[:6])
    if not 1 <= port <= 65535:
        raise LinkError(f"link {name!r}: port {port_text[:6]} is not within 1…65535")
    try:
        found = socket.getaddrinfo(host, port, socket.AF_INET)
    except (OSError, UnicodeError) as error:
        raise LinkError(f"link {name!r}: unknown host {host!r} ({error}). Check the name or use a number") from None
    return str(found[0][4][0]), port
