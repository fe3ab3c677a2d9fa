"""Resolving: from the host of a link to a socket address. Done once, when the link is opened, because DNS may block."""

import errno
import socket
from dataclasses import dataclass

from tui_gcs.core.links.base import reason
from tui_gcs.core.links.spec import LinkError, LinkSpec
from tui_gcs.core.mavlink.sources import Address


@dataclass(frozen=True)
class ResolvedAddress:
    """A socket address to bind or to connect to."""

    family: socket.AddressFamily
    address: Address


def resolve(spec: LinkSpec) -> ResolvedAddress:
    """Return the address that `spec` means. IPv4 first: "localhost" is 127.0.0.1, which simulators send to.

    Raises:
        LinkError: unknown host.
    """
    # "localhost" must be 127.0.0.1, where simulators send to, also where IPv6 comes first in /etc/hosts.
    families = (socket.AF_INET6,) if ":" in spec.host else (socket.AF_INET, socket.AF_INET6)
    why = ""
    for family in families:
        try:
            found = socket.getaddrinfo(spec.host, spec.port, family)
        except (OSError, UnicodeError) as error:
            why = why or reason(error)
            continue
        where = found[0][4]
        if len(where) == 4:
            return ResolvedAddress(family, (str(where[0]), int(where[1]), int(where[2]), int(where[3])))
        return ResolvedAddress(family, (str(where[0]), int(where[1])))
    raise LinkError(f"link {spec.name!r}: unknown host {spec.host!r} ({why}). Check the name or use a number")


def listen_advice(error: OSError, spec: LinkSpec) -> str:
    """Return why the port of `spec` cannot be used for listening, and what to do."""
    if error.errno == errno.EADDRINUSE:
        return f"port {spec.port} is busy: another ground station or simulator uses it. Close it or take another port"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"{spec.host} is not an address of this machine. Use 0.0.0.0 or 127.0.0.1"
    if error.errno == errno.EACCES:
        return f"no permission for port {spec.port}. Take a port above 1023"
    return f"cannot listen on {spec.place}: {reason(error)}"
