"""The links screen: links against their budgets, paths with their losses, partners, and changes of links."""

import math

import pytest
from msgspec.structs import replace

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.link_report import (
    AddLink,
    AddPartner,
    CloseLink,
    ClosePartner,
    GetLinks,
    LinkReport,
    LinkRow,
    PartnerRow,
    PathRow,
    RadioRow,
    SetLinkRate,
)

PARTNER = "udpout:10.0.0.9:14550"
LAN, RADIO = "udpin:127.0.0.1:14550", "serial:/dev/ttyUSB0:57600"


def link(name: str, **other: object) -> LinkRow:
    usual = LinkRow(
        name=name,
        network="",
        up=True,
        error="",
        capacity_bytes_per_s=None,
        telemetry_bytes_per_s=3120.0,
        budget_bytes_per_s=None,
        set_name="full",
        vehicles=2,
        bytes_in=100_000,
        bytes_out=20_000,
        frames=4000,
        junk_bytes=0,
        bad_crc=0,
        kernel_drops=0,
        send_refused=0,
        secure=False,
        high_latency=False,
    )
    return replace(usual, **other)


def path(vehicle: int, link_name: str, **other: object) -> PathRow:
    usual = PathRow(
        vehicle, link_name, "127.0.0.1:40001", "used", True, 0.1, 2000, 0.0, math.nan, 0, 0, "unsigned", 0.012, 0.01
    )
    return replace(usual, **other)


def linked(station: FakeStation) -> None:
    """Two links; vehicle 2 has both, vehicle 3 a poor radio; another station listens and may command."""
    radio = RadioRow(
        txbuf_pct=77, rssi=190, remote_rssi=180, noise=40, remote_noise=45, rx_errors=3, fixed=1, age_s=0.4
    )
    links = (
        link(LAN),
        link(RADIO, capacity_bytes_per_s=4032, budget_bytes_per_s=2822.0, set_name="normal", radio=radio, secure=True),
    )
    paths = (
        path(1, LAN),
        path(2, LAN),
        path(2, RADIO, in_use=False, rtt_s=math.nan, duplicates=1234, signing="signed by us"),
        path(3, RADIO, loss_pct=12.5, up_loss_pct=3.0, rtt_s=0.34, signing="signed, not verified"),
        path(4, RADIO, state="conflict", in_use=False),
    )
    partner = PartnerRow(
        PARTNER,
        True,
        True,
        "",
        "10.0.0.9:14550",
        ("255/190",),
        0.2,
        90_000,
        {"by the rules": 3},
        bytes_in=700,
        passed=7,
    )
    station.link_report = LinkReport(station.t_s, links, paths, (partner,), passed=7)


async def look(c: Console, seconds: float = 0.0) -> None:
    """Time passes, and the screen asks again."""
    c.station.tick(seconds)
    c.clock.advance(seconds)
    c.app.screen.look()
    await c.settle()


async def opened(c: Console, *keys: str) -> None:
    await c.press("S", "l")
    await look(c, 2.0)
    report = c.station.link_report
    assert report is not None
    moved = tuple(replace(each, bytes_in=each.bytes_in + 6000, bytes_out=each.bytes_out + 800) for each in report.links)
    c.station.link_report = replace(report, links=moved)
    await look(c, 2.0)
    await c.press(*keys)


def panel(c: Console) -> str:
    return " ".join(c.app.screen.panel.text().split())


def changes(c: Console) -> list[object]:
    return [
        r for r in c.station.requests if isinstance(r, AddLink | CloseLink | SetLinkRate | AddPartner | ClosePartner)
    ]


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
@pytest.mark.parametrize(
    ("view", "keys"), [("links", ["down"]), ("paths", ["w"]), ("partners", ["tab", "tab"]), ("forward", ["F"])]
)
async def test_pictures(view: str, keys: list[str], size: tuple[int, int]) -> None:
    async with console(size, linked) as c:
        await opened(c, *keys)
        assert same_as_snapshot(f"links-{view}-{size[0]}x{size[1]}", c.text())


async def test_what_goes_over_a_link_is_measured_and_compared_with_its_budget() -> None:
    async with console(WIDE, linked) as c:
        await opened(c, "down")
        lan = c.app.screen.link_list.rows[0]
        assert (lan.in_bytes_per_s, lan.out_bytes_per_s) == (1500.0, 200.0)
        assert "set 'normal': at most 3120 B/s; budget: 2822 B/s" in panel(c)
        assert "rssi 190, at the vehicle 180" in panel(c) and "buffer 77 % free" in panel(c)


async def test_links_that_were_added_are_told_from_those_of_the_command_line() -> None:
    def added(station: FakeStation) -> None:
        linked(station)
        report = station.link_report
        assert report is not None
        here = replace(report.links[1], is_added=True, is_kept=True)
        simulated = replace(here, name="udpin:127.0.0.1:14551", is_kept=False)
        station.link_report = replace(report, links=(report.links[0], here, simulated))

    async with console(NARROW, added) as c:
        await opened(c)
        assert f"{LAN}   given at the start" in c.text()
        await c.press("down")
        assert f"{RADIO}   added here, kept" in c.text()
        await c.press("down")
        assert "udpin:127.0.0.1:14551   added here, until the station ends" in c.text()


async def test_the_worst_path_is_found_with_one_key() -> None:
    async with console(WIDE, linked) as c:
        await opened(c, "w")
        assert [row.vehicle for row in c.app.screen.path_list.rows][:2] == [4, 3]
        assert "NOT USED: conflict" in panel(c)
        await c.press("down")
        assert "lost from the vehicle 12.5 % of 2000 frames; to the vehicle: 3.0 %" in panel(c)
        assert "round trip 340 ms" in panel(c)
        await c.press("w")
        assert [row.vehicle for row in c.app.screen.path_list.rows] == [1, 2, 2, 3, 4]


async def test_only_paths_of_selected_vehicles_are_listed() -> None:
    async with console(WIDE, linked) as c:
        await opened(c, "tab")
        c.app.feed.selection.set((2,))
        await c.settle()
        rows = c.app.screen.path_list.rows
        assert [(row.link, row.in_use) for row in rows] == [(LAN, True), (RADIO, False)]
        await c.press("down")
        assert "1234 duplicates" in panel(c) and "signed by us" in panel(c)


async def test_what_of_a_partner_was_refused_is_shown() -> None:
    async with console(WIDE, linked) as c:
        await opened(c, "tab", "tab")
        assert "its commands are judged" in panel(c) and "refused: by the rules 3" in panel(c)
        assert "255/190" in c.text()


async def test_a_partner_is_added_and_only_listens() -> None:
    async with console(WIDE, linked) as c:
        await opened(c, "F")
        assert "only listens" in panel(c)
        await c.press(*["backspace"] * 30, *"udpout:192.0.2.7:14550,network=north", "enter")
        assert changes(c) == [AddPartner("udpout:192.0.2.7:14550,network=north")]
        assert "link changed" in panel(c) and PARTNER in c.text()
        await c.press("plus", *["backspace"] * 30, *"udpin:0.0.0.0:14570", "enter")
        assert changes(c)[-1] == AddPartner("udpin:0.0.0.0:14570")
        await c.press("plus", "escape")
        await c.press("plus", *["backspace"] * 30, "enter")
        assert len(changes(c)) == 2


async def test_the_permission_to_command_is_asked_for() -> None:
    async with console(NARROW, linked) as c:
        await opened(c, "F", *["backspace"] * 30, *"udpout:192.0.2.7:14550, commands", "enter")
        assert "let udpout:192.0.2.7:14550 command" in c.text()
        await c.press("enter", "escape")
        assert changes(c) == [] and "udpout:192.0.2.7:14550 was not added" in panel(c)
        await c.press("F", *["backspace"] * 30, *"udpout:192.0.2.7:14550,commands,network=a", "enter", "y")
        assert changes(c) == [AddPartner("udpout:192.0.2.7:14550,network=a", takes_commands=True)]


async def test_a_partner_is_closed_after_y_and_stays_after_esc() -> None:
    async with console(WIDE, linked) as c:
        await opened(c, "tab", "tab", "delete", "enter", "escape")
        assert changes(c) == [] and f"{PARTNER} stays open" in panel(c)
        await c.press("delete", "y")
        assert changes(c) == [ClosePartner(PARTNER)]


async def test_before_an_endpoint_is_closed_it_says_who_is_there() -> None:
    def several(station: FakeStation) -> None:
        linked(station)
        assert station.link_report is not None
        first = station.link_report.partners[0]
        rows = (first, replace(first, address="10.0.0.8:14550", refused={}), replace(first, address="", systems=()))
        station.link_report = replace(station.link_report, partners=rows)

    async with console(NARROW, several) as c:
        await opened(c, "tab", "tab")
        assert "others, or gone" in c.text()
        await c.press("delete")
        assert "2 stations there: no vehicle is heard there any more" in " ".join(c.text().replace("┃", " ").split())


async def test_what_a_closed_partner_sent_stays_shown_and_it_is_not_closed_again() -> None:
    def closed(station: FakeStation) -> None:
        linked(station)
        assert station.link_report is not None
        row = replace(station.link_report.partners[0], up=False, is_closed=True, error="closed by console-2")
        station.link_report = replace(station.link_report, partners=(row,))

    async with console(WIDE, closed) as c:
        await opened(c, "tab", "tab")
        assert "closed by console-2: nothing is sent there" in panel(c) and "refused: by the rules 3" in panel(c)
        await c.press("delete")
        assert changes(c) == [] and f"{PARTNER} is closed by console-2" in panel(c)


async def test_a_refused_partner_is_one_line() -> None:
    def refusing(station: FakeStation) -> None:
        linked(station)
        station.link_refusal = "udpout:127.0.0.1:14550 and udpin:127.0.0.1:14550 lead into each other"

    async with console(WIDE, refusing) as c:
        await opened(c, "F", "enter")
        assert "NOT DONE: udpout:127.0.0.1:14550 and udpin" in panel(c)


async def test_the_options_of_a_link_are_shown_while_it_is_typed() -> None:
    async with console(NARROW, linked) as c:
        await opened(c, "plus")
        assert ",secure = keys may be sent" in panel(c) and ",highlatency = satellite" in panel(c)
        await c.press(*"udpin:127.0.0.1:14551,secure,highlatency", "enter")
        assert changes(c) == [AddLink("udpin:127.0.0.1:14551,secure,highlatency")]
        assert ",secure = keys" not in panel(c)


async def test_a_partner_is_added_from_the_palette() -> None:
    async with console(WIDE, linked) as c:
        await c.press(":", *"links; add partner", "enter")
        await c.settle()
        await c.press("enter")
        assert changes(c) == [AddPartner("udpout:127.0.0.1:14560")]
        await c.press("f", ":", *"forward", "enter")
        assert c.app.current_mode == "links"


async def test_without_partners_it_says_how_to_have_some() -> None:
    def alone(station: FakeStation) -> None:
        linked(station)
        assert station.link_report is not None
        station.link_report = replace(station.link_report, partners=())

    async with console(WIDE, alone) as c:
        await opened(c, "tab", "tab")
        assert "nothing is forwarded: + adds another station" in c.text()
        await c.press("delete")
        assert "nothing is forwarded" in panel(c) and changes(c) == []


async def test_another_rate_is_set() -> None:
    async with console(WIDE, linked) as c:
        await opened(c, "down", "R", *["backspace"] * 6, *"2000", "enter")
        assert changes(c) == [SetLinkRate(RADIO, 2000)]
        assert "link changed" in panel(c)
        await c.press("R", *["backspace"] * 6, *"none", "enter")
        assert changes(c)[-1] == SetLinkRate(RADIO, None)
        await c.press("R", *["backspace"] * 6, *"fast", "enter")
        assert "is no rate" in panel(c) and len(changes(c)) == 2


async def test_a_link_is_added() -> None:
    async with console(WIDE, linked) as c:
        await opened(c, "plus", *["backspace"] * 30, *"udpin:127.0.0.1:14560,rate=500", "enter")
        assert changes(c) == [AddLink("udpin:127.0.0.1:14560,rate=500")]
        await c.press("plus", "escape")
        assert len(changes(c)) == 1


async def test_a_link_is_closed_after_y_and_stays_after_esc() -> None:
    async with console(WIDE, linked) as c:
        await opened(c, "delete", "enter", "escape")
        assert changes(c) == [] and "stays open" in panel(c)
        await c.press("C", "y")
        assert changes(c) == [CloseLink(LAN)]


async def test_of_a_path_its_link_is_changed() -> None:
    async with console(WIDE, linked) as c:
        await opened(c, "w", "down", "R", *["backspace"] * 6, *"900", "enter")
        assert changes(c) == [SetLinkRate(RADIO, 900)]


async def test_a_refusal_of_the_station_is_shown() -> None:
    def refusing(station: FakeStation) -> None:
        linked(station)
        station.link_refusal = "vehicle 1 is armed and heard over it alone: land first"

    async with console(WIDE, refusing) as c:
        await opened(c, "delete", "y")
        assert "NOT DONE: vehicle 1 is armed" in panel(c)


async def test_a_closed_link_is_not_closed_again() -> None:
    def closed(station: FakeStation) -> None:
        linked(station)
        assert station.link_report is not None
        station.link_report = replace(station.link_report, links=(link(LAN, up=False, error="closed by console-2"),))

    async with console(WIDE, closed) as c:
        await opened(c, "delete", "y")
        assert changes(c) == [] and "closed by console-2" in c.text()


async def test_without_a_link_nothing_is_changed() -> None:
    async with console(WIDE, lambda station: None) as c:
        await c.press("S", "l", "delete", "R")
        assert "no link is chosen" in panel(c)
        assert changes(c) == []


async def test_a_read_only_console_changes_nothing() -> None:
    async with console(WIDE, linked, read_only=True) as c:
        await opened(c, "plus", "delete", "R")
        assert "read-only" in panel(c)
        await c.press("escape", "F")
        assert "read-only" in panel(c)
        await c.press("escape", "tab", "tab", "delete", "y")
        assert "read-only" in panel(c)
        assert c.station.commands() == []


async def test_nothing_is_asked_while_another_screen_is_shown() -> None:
    async with console(WIDE, linked) as c:
        await opened(c)
        screen = c.app.screen
        await c.press("f")
        asked = sum(isinstance(r, GetLinks) for r in c.station.requests)
        screen.look()
        await c.settle()
        assert sum(isinstance(r, GetLinks) for r in c.station.requests) == asked > 0


async def test_the_palette_finds_the_screen() -> None:
    async with console(WIDE, linked) as c:
        await c.press(":", *"link", "enter")
        assert c.app.current_mode == "links"


async def test_text_is_text() -> None:
    def hostile(station: FakeStation) -> None:
        linked(station)
        assert station.link_report is not None
        paths = (path(1, LAN, address="[red]x[/]", signing="[b]unknown key[/b]"),)
        station.link_report = replace(station.link_report, paths=paths)

    async with console(WIDE, hostile) as c:
        await opened(c, "tab")
        assert "[red]x[/]" in c.text() and "[b]unknown key[/b]" in panel(c)
