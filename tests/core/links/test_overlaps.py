"""Which two links use one place, and which lead into each other."""

import socket

import pytest

from tui_gcs.core.links.overlaps import is_of_this_machine, led_into, same_place
from tui_gcs.core.links.spec import parse_link


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("udpin:127.0.0.1:14550", "udpin:127.0.0.1:14550,secure", True),
        ("udpout:localhost:14550", "udpout:127.0.0.1:14550", True),
        ("udpout:[::1]:14550", "udpout:[0:0:0:0:0:0:0:1]:14550", True),
        ("udpout:127.0.0.1:14550", "udpout:127.0.0.1:014550", True),
        ("udpout:127.0.0.1:14550", "udpout:127.0.0.1:14551", False),
        ("udpout:127.0.0.1:14550", "tcp:127.0.0.1:14550", False),
        ("serial:/dev/ttyUSB0", "serial:/dev/ttyUSB0:115200", True),
        ("serial:/dev/ttyUSB0", "udpin:127.0.0.1:14550", False),
    ],
)
def test_same_place(one: str, other: str, same: bool) -> None:
    assert same_place(parse_link(one), parse_link(other)) is same_place(parse_link(other), parse_link(one)) is same


@pytest.mark.parametrize(
    ("caller", "listener", "leads"),
    [
        ("udpout:127.0.0.1:14550", "udpin:127.0.0.1:14550", True),
        ("udpout:localhost:14550", "udpin:0.0.0.0:14550", True),
        ("udpout:0.0.0.0:14550", "udpin:127.0.0.1:14550", True),
        ("udpout:127.0.0.2:14550", "udpin:0.0.0.0:14550", True),
        ("udpout:[::ffff:127.0.0.1]:14550", "udpin:127.0.0.1:14550", True),
        ("tcp:127.0.0.1:5770", "tcpin:0.0.0.0:5770", True),
        ("udpout:127.0.0.2:14550", "udpin:127.0.0.1:14550", False),
        ("udpout:192.0.2.1:14550", "udpin:0.0.0.0:14550", False),
        ("udpout:127.0.0.1:14551", "udpin:127.0.0.1:14550", False),
        ("tcp:127.0.0.1:14550", "udpin:127.0.0.1:14550", False),
        ("udpin:127.0.0.1:14550", "udpin:127.0.0.1:14550", False),
        ("udpout:ground.example.org:14550", "udpin:0.0.0.0:14550", False),
    ],
)
def test_what_a_link_sends_may_arrive_at_another(caller: str, listener: str, leads: bool) -> None:
    specs = parse_link(caller), parse_link(listener)
    assert led_into(specs[0], [specs[1]]) == (specs[1].name if leads else "")
    assert led_into(specs[1], [specs[0]]) == (specs[0].name if leads else "")


def test_addresses_of_this_machine_are_known_without_asking_anybody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "getaddrinfo", None)
    assert is_of_this_machine("127.0.0.1") and is_of_this_machine("0.0.0.0")
    assert not is_of_this_machine("192.0.2.1") and not is_of_this_machine("ground.example.org")
