"""Links in detail, and links that are added, closed and re-rated while the station runs."""

import math
from pathlib import Path

import pytest

from tests.core.rigs.service_asking import answer_text, ask
from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.links import open_link
from tui_gcs.core.protocol import link_report as p
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.link_store import LinkStore
from tui_gcs.core.requests.links.link_requests import LinkRequests

pytestmark = pytest.mark.xdist_group("link ports")  # fixed ports of this machine, below those it gives out


def report(rig: ServiceRig) -> p.LinkReport:
    found = ask(rig, p.GetLinks()).link_report
    assert found is not None
    return found


def refused(rig: ServiceRig, request: object) -> str:
    reply = ask(rig, request)  # type: ignore[arg-type]
    assert not reply.ok
    return reply.text


def test_each_path_of_each_vehicle_is_listed(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1), Peer(2)).heard().run(3.0)
    paths = report(rig).paths
    assert [(path.vehicle, path.link, path.state, path.in_use) for path in paths] == [
        (1, "memory", "used", True),
        (2, "memory", "used", True),
    ]
    assert paths[0].frames > 10 and paths[0].loss_pct == 0.0 and paths[0].signing == "unsigned"
    assert paths[0].heard_age_s < 1.1
    assert math.isnan(paths[0].up_loss_pct)


def test_losses_both_ways_are_those_that_are_known(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1), loss=0.3).heard().run(20.0)
    rig.peers[1].say(
        "SYS_STATUS",
        onboard_control_sensors_present=0,
        onboard_control_sensors_enabled=0,
        onboard_control_sensors_health=0,
        load=0,
        voltage_battery=0,
        current_battery=-1,
        battery_remaining=-1,
        drop_rate_comm=1250,
        errors_comm=0,
        errors_count1=0,
        errors_count2=0,
        errors_count3=0,
        errors_count4=0,
    )
    rig.loss = 0.0
    rig.run(0.5)
    path = report(rig).paths[0]
    assert 15 < path.loss_pct < 45
    assert path.up_loss_pct == 12.5


def test_a_link_shows_its_set_against_its_budget_and_its_radio(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1), bytes_per_s=4000).heard().run(3.0)
    radio = {"rssi": 190, "remrssi": 180, "noise": 40, "remnoise": 45, "rxerrors": 3, "fixed": 1, "txbuf": 77}
    rig.peers[1].say("RADIO_STATUS", **radio)
    rig.run(0.5)
    link = report(rig).links[0]
    assert (link.name, link.up, link.vehicles, link.capacity_bytes_per_s) == ("memory", True, 1, 4000)
    assert link.budget_bytes_per_s == pytest.approx(2800)
    assert 0 < link.telemetry_bytes_per_s < 2800 and link.set_name
    assert link.radio is not None and (link.radio.txbuf_pct, link.radio.remote_rssi) == (77, 180)


def test_another_rate_changes_what_vehicles_are_asked_for(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard().run(6.0)
    assert report(rig).links[0].set_name == "full"
    assert ask(rig, p.SetLinkRate("memory", 600)).ok
    rig.run(1.0)
    link = report(rig).links[0]
    assert link.set_name != "full" and link.telemetry_bytes_per_s <= (link.budget_bytes_per_s or 0)
    assert ask(rig, p.SetLinkRate("memory", None)).ok
    rig.run(6.0)
    assert report(rig).links[0].set_name == "full"
    texts = [e.text for e in rig.station.records.events.since(0, 2000) if e.cls is EventClass.OPERATOR]
    assert "link memory at 600 B/s" in texts


def test_a_link_is_added_closed_and_opened_again(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    assert ask(rig, p.AddLink("udpin:127.0.0.1:21997")).ok
    rig.run(1.0)
    assert [link.name for link in report(rig).links] == ["memory", "udpin:127.0.0.1:21997"]
    assert "open already" in refused(rig, p.AddLink("udpin:127.0.0.1:21997"))
    assert ask(rig, p.CloseLink("udpin:127.0.0.1:21997")).ok
    rig.run(1.0)
    closed = report(rig).links[1]
    assert (closed.up, closed.error) == (False, "closed by cli")
    assert not [alarm for alarm in rig.station.parts.alarms.alarms() if "21997" in alarm.text]
    assert ask(rig, p.AddLink("udpin:127.0.0.1:21997,rate=5000")).ok
    assert report(rig).links[1].capacity_bytes_per_s == 5000
    assert ask(rig, p.CloseLink("udpin:127.0.0.1:21997")).ok


def test_what_would_be_sent_over_a_closed_link_is_counted(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    assert ask(rig, p.CloseLink("memory")).ok
    rig.run(5.0)
    assert report(rig).links[0].send_refused > 0
    assert report(rig).paths[0].heard_age_s > 3.0


def test_a_link_over_which_an_armed_vehicle_is_heard_stays_open(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1, armed=True, alt_rel_mm=20_000), Peer(2)).heard()
    assert "vehicle 1 is armed and heard over it alone" in refused(rig, p.CloseLink("memory"))
    assert report(rig).links[0].up


@pytest.mark.parametrize(
    ("link", "why"),
    [
        ("udpin:nowhere", "not HOST:PORT"),
        ("udpin:127.0.0.1:1,network=north", "no link had network 'north'"),
        ("replay:flight.tlog", "a recording is no link"),
        ("udpout:example.org:14550", "give the number"),
        ("carrier:\x1b[2J", "cannot be printed"),
        ("serial:/dev/no-such-device", "no such device. Plug it in"),
        ("udpout:255.255.255.255:14550", "no way to 255.255.255.255"),
    ],
)
def test_what_cannot_be_added_is_refused_in_one_line(tmp_path: Path, link: str, why: str) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    text = refused(rig, p.AddLink(link))
    assert why in text and "\x1b" not in text and "\n" not in text


def test_unknown_links_and_impossible_rates_are_refused(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    assert "no open link" in refused(rig, p.CloseLink("udpin:127.0.0.1:9"))
    assert "100 to" in refused(rig, p.SetLinkRate("memory", 5))


def test_a_sim_station_takes_links_of_this_machine_only(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    rig.station.parts.config.kind = RunKind.SIM
    for link in ("udpin:0.0.0.0:41998", "serial:/dev/ttyUSB0", "udpout:192.0.2.1:14550"):
        assert "SIM station" in refused(rig, p.AddLink(link))


ADDED = "udpin:127.0.0.1:21996"


def restarted(folder: Path, run: str, given: str = "") -> tuple[ServiceRig, LinkRequests]:
    """A station with the link `memory` of its command line and perhaps another, which has made the changes again."""
    rig = ServiceRig(folder, Peer(1))
    if given:
        rig.station.comms.links[given] = open_link(given, rig.clock)
    rig.station.parts.config.link_store = LinkStore(folder / "links.json", run)
    requests = LinkRequests(rig.station.parts)
    requests.recall()
    return rig, requests


def links_of(rig: ServiceRig) -> dict[str, tuple[bool, int | None]]:
    links = rig.station.comms.links
    return {name: (not link.is_closed, link.spec.bytes_per_s) for name, link in links.items()}


def ended(rig: ServiceRig) -> None:
    """The process was killed: the system closes its sockets."""
    for link in rig.station.comms.links.values():
        link.close()


def test_changes_of_links_are_there_again_after_a_kill(tmp_path: Path) -> None:
    rig, requests = restarted(tmp_path, "run-1")
    assert answer_text(requests, p.AddLink(f"{ADDED},rate=9000")) == f"link {ADDED} is open (at 9000 B/s)"
    assert answer_text(requests, p.SetLinkRate(ADDED, 5000)) == f"link {ADDED} at 5000 B/s"
    assert answer_text(requests, p.CloseLink("memory")) == "link memory is closed"
    ended(rig)
    again, _ = restarted(tmp_path, "run-1")
    assert links_of(again) == {"memory": (False, None), ADDED: (True, 5000)}
    assert again.station.comms.links["memory"].error == "closed by console-1"
    ended(again)


def test_the_options_of_a_link_are_said_and_there_again_after_a_kill(tmp_path: Path) -> None:
    rig, requests = restarted(tmp_path, "run-1")
    text = answer_text(requests, p.AddLink(f"{ADDED},secure,highlatency"))
    assert text == f"link {ADDED} is open (secure, so keys may be sent; highlatency, so commands only)"
    ended(rig)
    for run in ("run-1", "run-2"):
        again, requests = restarted(tmp_path, run)
        assert again.station.comms.links[ADDED].spec.secure and again.station.comms.links[ADDED].spec.high_latency
        assert again.station.comms.rates.rates_of(ADDED).silent
        ended(again)


def test_a_link_of_the_command_line_keeps_the_options_with_which_it_was_opened_again(tmp_path: Path) -> None:
    rig, requests = restarted(tmp_path, "run-1", given=ADDED)
    answer_text(requests, p.CloseLink(ADDED))
    answer_text(requests, p.AddLink(f"{ADDED},secure,rate=9000"))
    ended(rig)
    again, _ = restarted(tmp_path, "run-1", given=ADDED)
    spec = again.station.comms.links[ADDED].spec
    assert (spec.secure, spec.bytes_per_s) == (True, 9000)
    ended(again)
    later, _ = restarted(tmp_path, "run-2", given=ADDED)
    spec = later.station.comms.links[ADDED].spec
    assert (spec.secure, spec.bytes_per_s) == (False, None), "the command line counts"
    ended(later)


def test_a_new_start_has_its_own_links_and_those_that_were_added(tmp_path: Path) -> None:
    rig, requests = restarted(tmp_path, "run-1")
    answer_text(requests, p.AddLink(ADDED))
    answer_text(requests, p.SetLinkRate("memory", 5000))
    answer_text(requests, p.CloseLink("memory"))
    ended(rig)
    later, requests = restarted(tmp_path, "run-2")
    assert links_of(later) == {"memory": (True, None), ADDED: (True, None)}
    assert {row.name: row.is_added for row in report(later).links} == {"memory": False, ADDED: True}
    answer_text(requests, p.CloseLink(ADDED))
    assert {row.name: row.is_added for row in report(later).links} == {"memory": False, ADDED: True}
    ended(later)
    last, _ = restarted(tmp_path, "run-3")
    assert links_of(last) == {"memory": (True, None)}


def test_what_cannot_be_done_again_is_one_line(tmp_path: Path) -> None:
    rig, requests = restarted(tmp_path, "run-1")
    answer_text(requests, p.AddLink(ADDED))
    other, _ = restarted(tmp_path, "run-1")  # the port is taken
    texts = other.texts("station")
    assert len(texts) == 1 and texts[0].startswith(f"link {ADDED} is not as it was left on the links screen: ")
    assert links_of(other) == {"memory": (True, None)}
    ended(rig)


def test_a_device_that_is_away_at_a_restart_is_opened_when_it_comes_back(tmp_path: Path) -> None:
    (tmp_path / "links.json").write_text('{"added": {"serial:/dev/no-such-device": "serial:/dev/no-such-device"}}')
    rig, _ = restarted(tmp_path, "run-1")
    assert "serial:/dev/no-such-device" in links_of(rig)
    assert rig.texts("station") == ["link serial:/dev/no-such-device is open as before"]


def test_a_link_that_cannot_be_opened_again_can_be_forgotten(tmp_path: Path) -> None:
    (tmp_path / "links.json").write_text('{"added": {"udpin:127.0.0.1:9": "udpin:127.0.0.1:9,network=north"}}')
    rig, requests = restarted(tmp_path, "run-1")
    (text,) = rig.texts("station")
    assert "no link had network 'north'" in text and text.endswith("; `tui-gcs link close` forgets it")
    assert answer_text(requests, p.CloseLink("udpin:127.0.0.1:9")).endswith("is not opened by later stations any more")
    again, _ = restarted(tmp_path, "run-2")
    assert again.texts("station") == []


@pytest.mark.parametrize("content", [b"{", b"[1]", b"\xff\xfe", b'{"added": 3}'])
def test_a_damaged_file_is_one_line_and_no_failed_start(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "links.json").write_bytes(content)
    rig, _ = restarted(tmp_path, "run-1")
    assert [text.startswith("changes of links are lost: ") for text in rig.texts("station")] == [True]


def test_hostile_names_in_the_file_are_refused_in_clean_words(tmp_path: Path) -> None:
    (tmp_path / "links.json").write_text('{"added": {"x\\u001b[2J": "nonsense\\u001b[2J"}}')
    rig, _ = restarted(tmp_path, "run-1")
    (text,) = rig.texts("station")
    assert "\x1b" not in text and text.startswith("link x␛[2J is not as it was left")


def test_a_disk_that_takes_nothing_is_said_with_the_change(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1))
    rig.station.parts.config.link_store = LinkStore(tmp_path / "nowhere" / "links.json", "run-1")
    assert "; NOT kept for a restart: " in answer_text(LinkRequests(rig.station.parts), p.SetLinkRate("memory", 5000))
