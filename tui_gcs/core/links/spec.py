"""Link specifications: the text by which an operator names a link, and its meaning."""

import ipaddress
import re
from dataclasses import dataclass
from typing import Any

FORMS = (
    "udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT, serial:DEVICE[:BAUD] or replay:FILE.tlog, "
    "each with [,network=NAME][,secure][,highlatency][,rate=BYTES_PER_S]"
)
HOST_SCHEMES = ("udpin", "udpout", "tcp", "tcpin")
DEFAULT_BAUD = 57600
"""Baud rate of SiK telemetry radios."""
SERIAL_SHARE = 0.7
"""Share of a serial line that is used: a radio needs the rest for its own protocol and for the other direction."""

# Limits of what an operator types, so that a pasted file ends in one clear line.
_MAX_TEXT = 1024
_MAX_BAUD = 12_000_000
_MAX_RATE = 1_000_000_000
_BITS_PER_SERIAL_BYTE = 10  # 8 data bits, start and stop bit
_HOST = re.compile(r"[A-Za-z0-9_]([A-Za-z0-9_.-]{0,251}[A-Za-z0-9_])?\.?")
_NETWORK = re.compile(r"[a-z0-9-]{1,16}")
_NUMBER = re.compile(r"[0-9]{1,12}")


class LinkError(Exception):
    """A link cannot be named or opened like this: one line with what, why and what to do."""


@dataclass(frozen=True)
class LinkSpec:
    """One link as the operator described it. A scheme uses only `host`/`port`, `device`/`baud` or `place`."""

    name: str
    """As written, without options: the link's unique key, e.g. "udpin:127.0.0.1:14550"."""
    scheme: str
    """udpin, udpout, tcp, tcpin, serial or replay."""
    place: str
    """The text behind the scheme: HOST:PORT, DEVICE[:BAUD] or the file."""
    host: str = ""
    """Name or number; an IPv6 address without its brackets."""
    port: int = 0
    device: str = ""
    baud: int = DEFAULT_BAUD
    network: str = ""
    """The network that its system ids belong to; "" is the default network."""
    secure: bool = False
    """The operator vouches that the link cannot be overheard: keys may be sent over it."""
    high_latency: bool = False
    """A satellite link: HIGH_LATENCY2 and commands only."""
    bytes_per_s: int | None = None
    """Budget of the link, both directions together; None is no limit."""


def is_loopback(host: str) -> bool:
    """Return whether `host` is this machine for certain: a name or no host (serial) may lead anywhere."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def is_number(host: str) -> bool:
    """Return whether `host` is the number of an address, so that nothing has to be looked up to use it."""
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return host == "localhost"
    return True


def parse_link(text: str) -> LinkSpec:
    """Return the link that `text` names, e.g.

    "udpin:0.0.0.0:14550,network=north,rate=5000". Opens and resolves nothing.

    Raises:
        LinkError: `text` is no such name; one line with what is wrong and the allowed forms.
    """
    if len(text) > _MAX_TEXT or not text.isprintable():
        raise _error(text, "too long" if len(text) > _MAX_TEXT else "a character in it cannot be printed")
    name, *written = text.strip().split(",")
    name = name.strip()
    scheme, _, place = name.partition(":")
    options = _options(text, written)
    common: dict[str, Any] = {"name": name, "scheme": scheme, "place": place}
    if scheme in HOST_SCHEMES:
        host, port = _host_and_port(text, place)
        return LinkSpec(**common, host=host, port=port, **options)
    if scheme == "serial":
        device, baud = _device_and_baud(text, place)
        options.setdefault("bytes_per_s", int(SERIAL_SHARE * baud / _BITS_PER_SERIAL_BYTE))
        return LinkSpec(**common, device=device, baud=baud, **options)
    if scheme == "replay":
        if not place.endswith(".tlog") or place == ".tlog":
            raise _error(text, "not a FILE.tlog")
        return LinkSpec(**common, **options)
    hint = ", which is udpin here" if scheme == "udp" else ""  # MAVProxy's and pymavlink's word for it
    raise _error(text, f"unknown kind {scheme[:40]!r}{hint}")


def _options(text: str, written: list[str]) -> dict[str, Any]:
    """Return the fields of `LinkSpec` that the options set."""
    options: dict[str, Any] = {}
    for option in written:
        field, value = _option(text, option.strip())
        if field in options:
            raise _error(text, f"option {option.strip()[:40]!r}: given twice")
        options[field] = value
    return options


def _option(text: str, option: str) -> tuple[str, Any]:
    """Return (field of `LinkSpec`, its value) of one option."""
    key, equals, value = option.partition("=")
    if option == "secure":
        return "secure", True
    if option == "highlatency":
        return "high_latency", True
    if key == "network" and equals:
        if not _NETWORK.fullmatch(value):
            raise _error(text, f"network {value[:40]!r} is not 1 to 16 of a-z, 0-9 and -")
        return "network", value
    if key == "rate" and equals:
        if not _NUMBER.fullmatch(value) or not 1 <= int(value) <= _MAX_RATE:
            raise _error(text, f"rate {value[:40]!r} is not a number of bytes per second within 1…{_MAX_RATE}")
        return "bytes_per_s", int(value)
    raise _error(text, f"unknown option {option[:40]!r}")


def _host_and_port(text: str, place: str) -> tuple[str, int]:
    """Parse HOST:PORT, with an IPv6 address in brackets."""
    host, separator, port_text = place.rpartition(":")
    if not separator or not host or not _NUMBER.fullmatch(port_text):
        raise _error(text, "not HOST:PORT")
    if not 1 <= int(port_text) <= 65535:
        raise _error(text, f"port {port_text} is not within 1…65535")
    if host.startswith("[") and host.endswith("]"):
        try:
            ipaddress.IPv6Address(host[1:-1])
        except ValueError:
            raise _error(text, f"{host[:60]!r} is no IPv6 address") from None
        return host[1:-1], int(port_text)
    if ":" in host:
        raise _error(text, "an IPv6 address goes in brackets, e.g. udpin:[::1]:14550")
    if not _HOST.fullmatch(host):
        raise _error(text, f"{host[:60]!r} is no host name")
    return host, int(port_text)


def _device_and_baud(text: str, place: str) -> tuple[str, int]:
    """Parse DEVICE[:BAUD]. A device by path has colons of its own and ends e.g. in ":1.0"."""
    device, separator, baud_text = place.rpartition(":")
    if not separator or "." in baud_text:
        device, baud_text = place, str(DEFAULT_BAUD)
    if not device or device.endswith("/"):
        raise _error(text, "not DEVICE or DEVICE:BAUD, e.g. serial:/dev/ttyUSB0:57600")
    if not _NUMBER.fullmatch(baud_text) or not 1 <= int(baud_text) <= _MAX_BAUD:
        raise _error(text, f"baud {baud_text[:40]!r} is not a number within 1…{_MAX_BAUD}")
    return device, int(baud_text)


def _error(text: str, why: str) -> LinkError:
    return LinkError(f"link {text[:80]!r}: {why}; allowed: {FORMS}")
