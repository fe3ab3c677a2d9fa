"""Forwarding partners that are added and closed while the station runs, over real sockets of this machine."""

import socket
from pathlib import Path

import pytest

from tests.core.rigs.link_rig import free_port
from tests.core.rigs.service_asking import answer_text, ask
from tests.core.rigs.service_rig import Fields, Peer, ServiceRig
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.protocol import link_report as p
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.link_store import LinkStore
from tui_gcs.core.requests.links.link_requests import LinkRequests

pytestmark = pytest.mark.xdist_group("link ports")  # fixed ports of this machine, below those it gives out

PAUSE, PAUSE_HOLD = 193, {"param1": 0.0}


class GroundStation:
    """Another station: a UDP socket that hears, and sends with its own system id."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.encoder = Encoder(252, 190)

    @property
    def link(self) -> str:
        """What an operator types to forward to it."""
        return f"udpout:127.0.0.1:{self.socket.getsockname()[1]}"

    def heard(self) -> list[tuple[int, str]]:
        """(system, message) of all frames that came since the last look."""
        found = []
        while True:
            try:
                frames = cut_datagram(self.socket.recv(65535)).frames
            except BlockingIOError:
                return found
            found += [(frame.system, decode(frame).name) for frame in frames]  # type: ignore[union-attr]

    def say(self, rig: ServiceRig, name: str, **fields: object) -> None:
        """Send to the station's endpoint that talks to this socket."""
        (port,) = [port for port in rig.station.comms.forwarder.ports if port.link.name == self.link]
        address = port.link._socket.getsockname()  # type: ignore[attr-defined]
        self.socket.sendto(self.encoder.encode(name, **fields), address)

    def hold(self, rig: ServiceRig, vehicle: int = 1) -> None:
        """Ask a vehicle to hold."""
        values = {f"param{n}": 0.0 for n in range(1, 8)} | PAUSE_HOLD
        to = {"target_system": vehicle, "target_component": 1}
        self.say(rig, "COMMAND_LONG", command=PAUSE, confirmation=0, **values, **to)

    def __enter__(self) -> "GroundStation":
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()


def partners(rig: ServiceRig) -> tuple[p.PartnerRow, ...]:
    found = ask(rig, p.GetLinks()).link_report
    assert found is not None
    return found.partners


def refused(rig: ServiceRig, link: str, *, takes_commands: bool = False) -> str:
    reply = ask(rig, p.AddPartner(link, takes_commands))
    assert not reply.ok
    assert "\n" not in reply.text and "\x1b" not in reply.text
    return reply.text


def holds(peer: Peer) -> list[Fields]:
    return [fields for fields in peer.got("COMMAND_LONG") if fields["command"] == PAUSE]


def ended(rig: ServiceRig) -> None:
    """The process was killed: the system closes its sockets."""
    for link in (*rig.station.comms.links.values(), *(port.link for port in rig.station.comms.forwarder.ports)):
        link.close()


def test_a_partner_hears_the_vehicles_from_the_moment_it_is_added_to_that_it_is_closed(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1), Peer(2)).heard()
    with GroundStation() as other:
        assert ask(rig, p.AddPartner(other.link)).text == f"{other.link} hears the vehicles"
        rig.run(2.0)
        assert {(1, "HEARTBEAT"), (2, "HEARTBEAT"), (1, "GLOBAL_POSITION_INT")} <= set(other.heard())
        assert ask(rig, p.ClosePartner(other.link)).text == f"{other.link} does not hear the vehicles any more"
        other.heard()
        rig.run(2.0)
        assert other.heard() == []
        texts = [e.text for e in rig.station.records.events.since(0, 2000) if e.cls is EventClass.OPERATOR]
        assert texts == [f"{other.link} hears the vehicles", f"{other.link} does not hear the vehicles any more"]
        assert [alarm.text for alarm in rig.station.parts.alarms.alarms() if "forward" in alarm.text] == []


def test_a_partner_without_the_permission_commands_nothing(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1, armed=True, alt_rel_mm=20_000)).heard()
    with GroundStation() as other:
        assert ask(rig, p.AddPartner(other.link)).ok
        other.hold(rig)
        rig.run(2.0)
        assert holds(rig.peers[1]) == []
        assert partners(rig)[0].takes_commands is False and partners(rig)[0].passed == 0
        ended(rig)


def test_commands_of_a_partner_are_judged_and_leave_through_the_uplink(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1, armed=True, alt_rel_mm=20_000)).heard()
    with GroundStation() as other:
        reply = ask(rig, p.AddPartner(other.link, takes_commands=True))
        assert reply.text == f"{other.link} hears the vehicles; its commands are judged, and may reach vehicles"
        other.hold(rig)
        other.say(rig, "SET_GPS_GLOBAL_ORIGIN", target_system=1, latitude=0, longitude=0, altitude=0, time_usec=0)
        rig.run(2.0)
        assert len(holds(rig.peers[1])) == 1
        row = partners(rig)[0]
        assert (row.passed, row.refused, row.systems) == (1, {"not on the list": 1}, ("252/190",))
        assert row.bytes_in > 40 and row.bytes_out > 100
        ended(rig)


def test_what_a_closed_partner_sends_reaches_nothing_and_what_was_refused_stays_shown(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1, armed=True, alt_rel_mm=20_000)).heard()
    with GroundStation() as other:
        ask(rig, p.AddPartner(other.link, takes_commands=True))
        other.say(rig, "SET_GPS_GLOBAL_ORIGIN", target_system=1, latitude=0, longitude=0, altitude=0, time_usec=0)
        rig.run(1.0)
        other.hold(rig)  # it lies in the socket when the partner is closed
        assert ask(rig, p.ClosePartner(other.link), "console-1").ok
        rig.run(90.0)
        assert holds(rig.peers[1]) == []
        row = partners(rig)[0]
        assert (row.up, row.is_closed, row.error) == (False, True, "closed by console-1")
        assert row.is_added, "also when it is closed"
        assert row.refused == {"not on the list": 1} and row.systems == ("252/190",) and row.bytes_in > 0
        assert "nothing is forwarded to" in ask(rig, p.ClosePartner(other.link)).text


def test_what_was_refused_of_a_partner_that_is_gone_stays_shown(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    port = free_port()
    assert ask(rig, p.AddPartner(f"udpin:127.0.0.1:{port}", takes_commands=True)).ok
    assert [(row.address, row.refused) for row in partners(rig)] == [("", {})], "nobody is there yet"
    with GroundStation() as other:
        fields = {"target_system": 1, "latitude": 0, "longitude": 0, "altitude": 0, "time_usec": 0}
        other.socket.sendto(other.encoder.encode("SET_GPS_GLOBAL_ORIGIN", **fields), ("127.0.0.1", port))
        address = f"127.0.0.1:{other.socket.getsockname()[1]}"
    rig.run(1.0)
    assert [(row.address, row.refused) for row in partners(rig)] == [(address, {"not on the list": 1})]
    rig.run(70.0)
    assert [(row.address, row.refused) for row in partners(rig)] == [("", {"not on the list": 1})]
    ended(rig)


def test_a_closed_partner_is_added_again_with_another_permission(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    with GroundStation() as other:
        ask(rig, p.AddPartner(other.link, takes_commands=True))
        assert refused(rig, other.link) == f"{other.link} is forwarded to already"
        ask(rig, p.ClosePartner(other.link))
        assert ask(rig, p.AddPartner(other.link)).ok
        assert [(row.up, row.takes_commands) for row in partners(rig)] == [(True, False)]
        ended(rig)


@pytest.mark.parametrize(
    ("link", "why"),
    [
        ("udpout:nowhere", "not HOST:PORT"),
        ("udpout:127.0.0.1:99999", "not within 1…65535"),
        ("replay:flight.tlog", "a recording is no link"),
        ("udpout:example.org:14550", "give the number"),
        ("udpout:127.0.0.1:21001,network=north", "no link had network 'north'"),
        ("udpout:127.0.0.1:21001,rate=500", "a partner has network= only"),
        ("udpout:127.0.0.1:21001,secure", "a partner has network= only"),
        ("udpout:255.255.255.255:14550", "no way to 255.255.255.255"),
        ("serial:/dev/no-such-device", "no such device. Plug it in"),
        ("udpin:192.0.2.1:14550", "is not an address of this machine"),
        ("carrier:\x1b[2J\n", "cannot be printed"),
        ("udpout:127.0.0.1:21001" + "9" * 5000, "too long"),
        ("", "unknown kind ''"),
    ],
)
def test_what_cannot_be_forwarded_to_is_refused_in_one_line(tmp_path: Path, link: str, why: str) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    assert why in refused(rig, link)
    assert partners(rig) == ()


def test_a_link_and_a_partner_do_not_lead_into_each_other(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    port, other = free_port(), free_port()
    link, partner = f"udpin:0.0.0.0:{port}", f"udpin:127.0.0.1:{other}"
    assert ask(rig, p.AddLink(link)).ok and ask(rig, p.AddPartner(partner)).ok
    for host in ("127.0.0.1", "localhost", "0.0.0.0"):
        assert f"and {link} lead into each other" in refused(rig, f"udpout:{host}:{port}")
    assert f"{link} is a link to vehicles already" in refused(rig, link)
    assert f"and {partner} lead into each other" in refused(rig, f"udpout:127.0.0.1:{other}")
    assert f"and {partner} lead into each other" in ask(rig, p.AddLink(f"udpout:127.0.0.1:{other}")).text
    assert f"{partner} is forwarded to already" in ask(rig, p.AddLink(partner)).text
    assert ask(rig, p.AddPartner(f"udpout:192.0.2.9:{port}")).ok, "the same port of another machine"
    ended(rig)


def test_one_address_has_one_partner_however_it_is_written(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    port = free_port()
    assert ask(rig, p.AddPartner(f"udpout:127.0.0.1:{port}")).ok
    assert refused(rig, f"udpout:localhost:{port}").endswith(f"(udpout:127.0.0.1:{port}) is forwarded to already")
    ended(rig)


def test_a_port_of_another_program_is_refused(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    with GroundStation() as other:
        busy = other.link.replace("udpout", "udpin")
        assert f"{busy}: port {busy.rpartition(':')[2]} is busy" in refused(rig, busy)


def test_a_sim_station_forwards_within_this_machine_only(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    rig.station.parts.config.kind = RunKind.SIM
    for link in ("udpout:192.0.2.1:14550", "udpin:0.0.0.0:41998", "serial:/dev/ttyUSB0"):
        assert "SIM station" in refused(rig, link)


def test_twenty_partners_are_four_too_many_and_closed_ones_make_room(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    links = [f"udpout:127.0.0.1:{42000 + n}" for n in range(20)]
    replies = [ask(rig, p.AddPartner(link)) for link in links]
    assert [reply.ok for reply in replies] == [True] * 16 + [False] * 4
    assert replies[16].text == "16 partners are open already: close one first"
    rig.run(3.0)
    for link in links[:16]:
        assert ask(rig, p.ClosePartner(link)).ok
    for _ in range(3):  # closed ones are kept for their counts, but not all of them for ever
        for link in links:
            assert ask(rig, p.AddPartner(link)).ok
            assert ask(rig, p.ClosePartner(link)).ok
    assert len(partners(rig)) == 16


# ---------------------------------------------------------------- later starts


def restarted(folder: Path, run: str, *given: str, kind: RunKind = RunKind.LIVE) -> tuple[ServiceRig, LinkRequests]:
    """A station that forwards to `given` by its command line, and has made the kept changes again."""
    rig = ServiceRig(folder, Peer(1), forward=given)
    config = rig.station.parts.config
    config.link_store = LinkStore(folder / "links.json", run, keeps_added=kind is RunKind.LIVE)
    config.kind = kind
    requests = LinkRequests(rig.station.parts)
    requests.recall()
    return rig, requests


def open_partners(rig: ServiceRig) -> dict[str, bool]:
    """By name, whether its commands are judged."""
    return {port.link.name: port.commands for port in rig.station.comms.forwarder.ports if not port.is_closed}


def test_partners_are_there_again_after_a_kill_with_their_permission(tmp_path: Path) -> None:
    given = f"udpin:127.0.0.1:{free_port()}"
    rig, requests = restarted(tmp_path, "run-1", given)
    answer_text(requests, p.AddPartner("udpout:127.0.0.1:22101"))
    answer_text(requests, p.AddPartner("udpout:127.0.0.1:22102", takes_commands=True))
    answer_text(requests, p.AddPartner("udpout:127.0.0.1:22103"))
    answer_text(requests, p.ClosePartner("udpout:127.0.0.1:22103"))
    answer_text(requests, p.ClosePartner(given))
    ended(rig)
    again, _ = restarted(tmp_path, "run-1", given)
    assert open_partners(again) == {"udpout:127.0.0.1:22101": False, "udpout:127.0.0.1:22102": True}
    assert again.texts("station") == [
        "udpout:127.0.0.1:22101 hears the vehicles as before",
        "udpout:127.0.0.1:22102 hears the vehicles as before; its commands are judged, and may reach vehicles",
    ]
    ended(again)


def test_a_later_live_start_forwards_again_but_gives_nobody_the_right_to_command(tmp_path: Path) -> None:
    rig, requests = restarted(tmp_path, "run-1")
    answer_text(requests, p.AddPartner("udpout:127.0.0.1:22101"))
    answer_text(requests, p.AddPartner("udpout:127.0.0.1:22102", takes_commands=True))
    ended(rig)
    later, _ = restarted(tmp_path, "run-2")
    assert open_partners(later) == {"udpout:127.0.0.1:22101": False, "udpout:127.0.0.1:22102": False}
    first, second = later.texts("station")
    assert first == "udpout:127.0.0.1:22101 hears the vehicles as before", "never without a word"
    assert second.startswith("udpout:127.0.0.1:22102 hears the vehicles as before; its commands were allowed")
    ended(later)
    last, _ = restarted(tmp_path, "run-3")
    assert [text.endswith("hears the vehicles as before") for text in last.texts("station")] == [True, True]
    ended(last)


def test_a_partner_that_cannot_be_opened_again_can_be_forgotten(tmp_path: Path) -> None:
    (tmp_path / "links.json").write_text('{"partners": {"udpout:127.0.0.1:9": "udpout:127.0.0.1:9,network=north"}}')
    rig, requests = restarted(tmp_path, "run-1")
    (text,) = rig.texts("station")
    assert "no link had network 'north'" in text and text.endswith("; `tui-gcs forward close` forgets it")
    assert answer_text(requests, p.ClosePartner("udpout:127.0.0.1:9")).endswith(
        "is not opened by later stations any more"
    )
    again, _ = restarted(tmp_path, "run-2")
    assert again.texts("station") == []


def test_what_is_added_in_sim_ends_with_the_run(tmp_path: Path) -> None:
    rig, requests = restarted(tmp_path, "run-1", kind=RunKind.SIM)
    port = free_port()
    until = "; until this SIM station is ended"
    assert answer_text(requests, p.AddPartner("udpout:127.0.0.1:22101")).endswith(until)
    assert answer_text(requests, p.AddLink(f"udpin:127.0.0.1:{port}")).endswith(until)
    ended(rig)
    killed, requests = restarted(tmp_path, "run-1", kind=RunKind.SIM)
    assert open_partners(killed) == {"udpout:127.0.0.1:22101": False}
    assert f"udpin:127.0.0.1:{port}" in killed.station.comms.links
    ended(killed)
    later, _ = restarted(tmp_path, "run-2", kind=RunKind.SIM)
    assert open_partners(later) == {} and list(later.station.comms.links) == ["memory"]
    again, _ = restarted(tmp_path, "run-1", kind=RunKind.SIM)
    assert open_partners(again) == {}, "it was forgotten, not put aside"


def test_a_partner_of_the_command_line_is_open_at_the_next_start(tmp_path: Path) -> None:
    given = f"udpin:127.0.0.1:{free_port()}"
    rig, requests = restarted(tmp_path, "run-1", given)
    answer_text(requests, p.ClosePartner(given))
    answer_text(requests, p.AddPartner(given, takes_commands=True))
    ended(rig)
    killed, _ = restarted(tmp_path, "run-1", given)
    assert open_partners(killed) == {given: True}
    ended(killed)
    later, _ = restarted(tmp_path, "run-2", given)
    assert open_partners(later) == {given: False}, "what the command line says"
    ended(later)


def test_a_partner_that_cannot_be_opened_again_is_one_line(tmp_path: Path) -> None:
    rig, requests = restarted(tmp_path, "run-1")
    link = f"udpin:127.0.0.1:{free_port()}"
    answer_text(requests, p.AddPartner(link))
    other, _ = restarted(tmp_path, "run-1")  # the port is taken
    assert [text.startswith(f"partner {link} is not as it was left: ") for text in other.texts("station")] == [True]
    ended(rig)


def test_hostile_names_in_the_file_open_nothing(tmp_path: Path) -> None:
    (tmp_path / "links.json").write_text(
        '{"partners": {"x\\u001b[2J": "nonsense\\u001b[2J"}, "commanding": {"y": true}}'
    )
    rig, _ = restarted(tmp_path, "run-1")
    (text,) = rig.texts("station")
    assert "\x1b" not in text and text.startswith("partner x␛[2J is not as it was left")
    assert open_partners(rig) == {}
