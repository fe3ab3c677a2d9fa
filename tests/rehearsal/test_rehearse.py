"""`tui-gcs rehearse`: what goes wrong on purpose, and the report."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import msgspec
import numpy as np
import pytest

from tui_gcs.core.geometry.zones import Rectangle, Role, Zone
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.rehearsal.fault_schedule import FaultScheduleError, ScheduledFault, drains, losses, restart
from tui_gcs.rehearsal.lock_step import FlightConditions
from tui_gcs.rehearsal.rehearse import rehearse
from tui_gcs.rehearsal.report.flight_recording import FlightRecord, ZoneRecord
from tui_gcs.rehearsal.report.page import _heat, page
from tui_gcs.rehearsal.report.svg import MAX_POINTS, ChartLine, chart, heat, nice, thinned

SHIPPED = Path(__file__).parents[2] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"


def one_team(vehicles: tuple[int, ...] = (1, 2, 3)) -> Scenario:
    """The defenders' round 1, measured shortly; better tours are searched for in the first two seconds of each task."""
    whole = load(SHIPPED)
    team = msgspec.structs.replace(whole.teams[0], vehicles=vehicles, parameters={"search": 60})
    return msgspec.structs.replace(
        whole,
        teams=(team,),
        places=whole.places[: len(vehicles)],
        rounds=whole.rounds[:1],
        results=msgspec.structs.replace(whole.results, measured_s=20.0),
    )


# ---------------------------------------------------------------- what is planned


def test_a_loss_is_a_vehicle_a_time_and_perhaps_an_end() -> None:
    assert losses(["3@120", "4@60/30"]) == [
        ScheduledFault(120.0, "lose", 3),
        ScheduledFault(60.0, "lose", 4),
        ScheduledFault(90.0, "find", 4),
    ]


@pytest.mark.parametrize("wrong", ["3", "@120", "x@1", "3@-1", "3@1/", "3@1e9", "3@999999"])
def test_anything_else_is_refused_in_one_line(wrong: str) -> None:
    with pytest.raises(FaultScheduleError, match=re.escape(repr(wrong))):
        losses([wrong])


def test_a_battery_that_is_low_stays_so() -> None:
    assert drains(["3@120"]) == [ScheduledFault(120.0, "drain", 3)]
    with pytest.raises(FaultScheduleError, match="does not fill again"):
        drains(["3@120/30"])


def test_a_restart_is_a_killed_a_started_and_a_resumed_station() -> None:
    assert [h.what for h in restart(100.0)] == ["kill", "start", "resume"]
    assert [h.t_s for h in restart(100.0)] == [100.0, 103.0, 108.0]
    with pytest.raises(FaultScheduleError):
        restart(-1.0)


# ---------------------------------------------------------------- flown


class _Texts(HTMLParser):
    """Checks that tags close, and keeps the text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.texts: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert not any(name in ("src", "href") for name, _ in attrs), "nothing is fetched"
        if tag != "meta":
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Closed already."""

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


@pytest.mark.long
def test_a_fleet_loses_one_and_its_station_and_the_report_shows_it(tmp_path: Path) -> None:
    """One flight for all of it: it takes seconds."""
    records: list[FlightRecord] = []
    scenario = one_team()
    planned = [*losses(["3@75"]), *restart(130.0)]
    result, problem = rehearse(
        scenario,
        "",
        tmp_path,
        lambda share, text: None,
        faults=planned,
        watch=lambda bus, referee: records.append(FlightRecord(scenario, bus)),
    )
    assert problem == ""
    first = result.rounds[0]
    assert (first.round, first.n, first.cut_short) == ("round 1", 3, True)
    after = result.rounds[-1]
    assert (after.n, after.cut_short) == (2, False)
    assert after.ratio is not None and after.ratio < 2.0
    failed = [check.name for check in result.checks if not check.ok]
    assert failed == []
    commands = [json.loads(line) for line in (tmp_path / "run.jsonl").read_text().splitlines()]
    assert commands, "both stations wrote one journal"

    text = page(records[0], result, problem, conditions=[("wind", "<b>3,1")], happened=[(75.0, "vehicle 3 & more")])
    parser = _Texts()
    parser.feed(text)
    assert parser.open == []
    words = " ".join(parser.texts)
    assert "Every gate holds." in words
    assert "<b>3,1" in words, "as text, not as markup"
    assert "vehicle 3 & more" in words
    assert re.search(r"\d+ before the start", words), "links that come up are told, but not first"
    assert "what its planner counted last" in words and "; predicted worst " in words
    # One round was flown, in two parts: a metric has one chart for both.
    charts = len({s.name for s in result.metrics if s.low is not None and s.low != s.high})
    assert charts > 0
    assert text.count("<svg") == 5 + charts, "the mission, map, idleness, heat map, separation, the planner's metrics"
    assert "INCOMPLETE: no picture of the fleet for up to 3.1 s" in words, "nobody saw it while the station was dead"
    result.frames_lost = 3
    gaps = page(records[0], result, problem, conditions=[], happened=[])
    assert "figures are INCOMPLETE: 3 of" in gaps, "a reader of the page must not take it for the whole"
    (zone,) = records[0].rounds[0].zones
    assert min(zone.flying) < 3 == max(zone.flying)
    assert zone.tour_m, "the tour is drawn"
    assert set(records[0].rounds[0].paths_m) == {1, 2, 3}


@pytest.mark.long
@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_a_tired_vehicle_is_relieved_before_it_leaves_and_every_gate_holds(tmp_path: Path, autopilots: str) -> None:
    whole = one_team()
    team = msgspec.structs.replace(whole.teams[0], parameters={"reserve": 1, "search": 0})
    scenario = msgspec.structs.replace(whole, teams=(team,))
    result, problem = rehearse(
        scenario, "", tmp_path, lambda share, text: None, FlightConditions(autopilots), faults=drains(["2@80"])
    )
    assert problem == "" and [check.name for check in result.checks if not check.ok] == []
    assert (result.rounds[0].n, result.rounds[0].reserve) == (2, 1)
    assert "sends vehicle 2 home (relieved: its battery is low)" in (tmp_path / "run.jsonl").read_text()


def test_a_vehicle_that_is_not_simulated_cannot_be_lost(tmp_path: Path) -> None:
    with pytest.raises(FaultScheduleError, match="vehicle 9 is not simulated; there are 1, 2, 3"):
        rehearse(one_team(), "", tmp_path, lambda share, text: None, faults=losses(["9@5"]))


# ---------------------------------------------------------------- pictures


def test_what_happened_close_together_is_written_below_each_other_and_inside_the_picture() -> None:
    line = ChartLine("a", list(range(101)), [1.0] * 101, "#000000")
    happened = [(10.0, "vehicle 6 falls silent"), (12.0, "vehicle 2 falls silent"), (99.0, "vehicle 7 is low")]
    text = chart("t", [line], unit="s", marks=happened)
    found = re.findall(r'<text x="([^"]*)" y="(\d+)" class="note">([^<]*)', text)
    notes = {what: (float(x), float(y)) for x, y, what in found}
    assert notes["vehicle 6 falls silent"][1] < notes["vehicle 2 falls silent"][1]
    assert notes["vehicle 7 is low"][1] == notes["vehicle 6 falls silent"][1]
    assert notes["vehicle 7 is low"][0] < 650.0, "left of its line: at the right it would be cut"


def zone_of_one_row(seen_s: list[float]) -> ZoneRecord:
    zone = Zone("home", Role.DEFEND, Rectangle((5.0, 1.0), 10.0, 2.0), 20.0, 90.0)
    cells = np.array([[2.5 * i, 1.0] for i in range(len(seen_s))])
    return ZoneRecord(zone, "defend", 60.0, 4, cells, 2.5, np.array(seen_s), flying=[0, 3, 3, 2])


def test_of_a_zone_that_was_not_seen_whole_no_times_are_told() -> None:
    text = _heat(zone_of_one_row([0.0, np.inf, 0.0]))
    assert "to 0 s" not in text and "never seen" in text and ">seen<" in text
    assert "to 12 s" in _heat(zone_of_one_row([3.0, 12.0, 6.0]))


def test_the_ideal_of_a_zone_is_that_of_the_vehicles_that_flew_there() -> None:
    assert "ideal of 3 20.0 s" in _heat(zone_of_one_row([0.0, 1.0])), "one of the four never came"


def test_a_chart_leaves_gaps_where_nothing_is_known_and_escapes_names() -> None:
    nan = float("nan")
    line = ChartLine("a & b", [0.0, 1.0, 2.0, 3.0, 4.0], [1.0, 2.0, nan, 2.0, 1.0], "#000")
    text = chart("t", [line], unit="s", marks=[(2.0, "<x>")])
    assert text.count("<polyline") == 2
    assert "a &amp; b" in text
    assert "&lt;x&gt;" in text


@pytest.mark.parametrize(("value", "expected"), [(0.9, 1.0), (1.0, 1.0), (1.1, 2.0), (23.0, 25.0), (260.0, 500.0)])
def test_axes_end_at_round_numbers(value: float, expected: float) -> None:
    assert nice(value) == pytest.approx(expected)


def test_long_lines_are_thinned_and_keep_their_end() -> None:
    points = [(float(i), 0.0) for i in range(5000)]
    few = thinned(points)
    assert len(few) <= MAX_POINTS + 1
    assert few[-1] == points[-1]


def test_the_scale_ends_where_it_ends() -> None:
    assert heat(-1.0) == heat(0.0) != heat(1.0) == heat(2.0)
