"""Overlaps: two links of one station that would use the same place, or of which one leads into the other.

What vehicles send would come back as from another station, or be taken for further vehicles. Opens a socket to find out
whether an address is one of this machine, and sends nothing.
"""

import ipaddress
import socket
from collections.abc import Iterable

from tui_gcs.core.links.spec import LinkSpec, is_loopback, is_number

LISTENS, CALLS = ("udpin", "tcpin"), ("udpout", "tcp")
UNSPECIFIED = ("0.0.0.0", "::")  # noqa: S104 - compared with, not bound
"""Hosts that stand for every address of this machine."""


def same_place(one: LinkSpec, other: LinkSpec) -> bool:
    """Return whether both would use the same device, or the same port of the same address."""
    if one.scheme == "serial" or other.scheme == "serial":
        return one.scheme == other.scheme and one.device == other.device
    return one.scheme == other.scheme and one.port == other.port and _host(one) == _host(other)


def led_into(new: LinkSpec, links: Iterable[LinkSpec]) -> str:
    """Return the name of the link that `new` leads into, or that leads into `new`; "" if there is none."""
    return next((link.name for link in links if _leads_into(new, link) or _leads_into(link, new)), "")


def _leads_into(caller: LinkSpec, listener: LinkSpec) -> bool:
    """Return whether what `caller` sends arrives at `listener`."""
    if (caller.scheme, listener.scheme) not in set(zip(CALLS, LISTENS, strict=True)) or caller.port != listener.port:
        return False
    called, heard = _host(caller), _host(listener)
    return called == heard or ((heard in UNSPECIFIED or called in UNSPECIFIED) and is_of_this_machine(called))


def _host(spec: LinkSpec) -> str:
    """Return the host in one form: an address can be written in several, also IPv4 as IPv6 (`::ffff:127.0.0.1`)."""
    if spec.host == "localhost":
        return "127.0.0.1"
    try:
        address = ipaddress.ip_address(spec.host)
    except ValueError:
        return spec.host
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return str(mapped or address)


def is_of_this_machine(host: str) -> bool:
    """Return whether the number `host` is an address of this machine. Names are not looked up: that may take long."""
    if host in UNSPECIFIED or is_loopback(host):
        return True
    if not is_number(host):
        return False
    # A socket can be bound to an address of this machine only.
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as udp:
            udp.bind((host, 0))
    except OSError:
        return False
    return True
