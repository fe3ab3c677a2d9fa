"""What the commands refuse before a station starts on the operator's links."""

import os

import pytest

from tests.core.rigs.link_rig import free_port
from tui_gcs.cli.common import check_links, loopback_only
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.core.links import open_link


def refusal(check: object, *links: str) -> str:
    with pytest.raises(CommandError) as caught:
        check(list(links))  # type: ignore[operator]
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_good_links_are_left_free_again() -> None:
    port = free_port()
    master, slave = os.openpty()
    links = [f"udpin:127.0.0.1:{port},network=north,rate=5000", f"serial:{os.ttyname(slave)},secure", "tcp:127.0.0.1:1"]
    check_links(links)
    check_links(links)
    os.close(master)
    os.close(slave)


def test_a_wrong_link_is_told() -> None:
    assert "unknown option 'fast'" in refusal(check_links, "udpin:127.0.0.1:14550,fast")
    assert "unknown kind" in refusal(loopback_only, "nonsense")


def test_a_device_that_is_not_there_is_told() -> None:
    assert refusal(check_links, "serial:/dev/no-such-device") == (
        "serial:/dev/no-such-device: no such device. Plug it in or check the name"
    )


def test_a_link_named_twice_is_told() -> None:
    assert "named twice" in refusal(check_links, "tcp:127.0.0.1:5760,network=a", "tcp:127.0.0.1:5760,network=b")


def test_links_that_stand_in_each_others_way_are_told() -> None:
    master, slave = os.openpty()
    device = os.ttyname(slave)
    assert "another program uses the device" in refusal(check_links, f"serial:{device}", f"serial:{device}:57600")
    os.close(master)
    os.close(slave)
    port = free_port()
    assert "is busy" in refusal(check_links, f"udpin:0.0.0.0:{port}", f"udpin:127.0.0.1:{port}")


def test_no_way_to_a_partner_is_told_before_the_start_and_no_error_of_a_restart() -> None:
    name = "udpout:255.255.255.255:14550"  # the system connects to no broadcast address
    assert refusal(check_links, name) == (
        f"{name}: no way to 255.255.255.255: Permission denied. Check the address and this machine's network"
    )
    link = open_link(name)
    assert link.error == "no way to 255.255.255.255: Permission denied"
    link.send(b"hello", "")
    assert (link.send_refused, link.error) == (1, "cannot send: Destination address required")
    link.close()


def test_a_recording_is_no_vehicle() -> None:
    assert "tui-gcs replay" in refusal(check_links, "replay:flight.tlog")


@pytest.mark.parametrize("link", ["udpin:127.0.0.1:14550", "tcp:localhost:5760,network=a", "tcpin:[::1]:5760"])
def test_simulators_are_on_this_machine(link: str) -> None:
    loopback_only([link])


@pytest.mark.parametrize(
    "link",
    [
        "udpin:0.0.0.0:14550",
        "udpin:[::]:14550",
        "tcp:127.example.org:5760",
        "tcp:localhost.example.org:5760",
        "serial:/dev/ttyUSB0:57600",
        "replay:flight.tlog",
    ],
)
def test_what_may_lead_elsewhere_is_no_simulator(link: str) -> None:
    assert "--kind sim takes loopback links only" in refusal(loopback_only, "udpin:127.0.0.1:14550", link)
