"""`kill -9` of the station in flight: the next one shows the truth, sends nothing that moves, and brings all home."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from tests.core.rigs.rig import Rig, scenario
from tui_gcs.core.firmware.ardupilot import ArduCopter
from tui_gcs.core.firmware.base import UNKNOWN_OFF_COURSE_M
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.preflight.vehicle_checks import plans_on_board
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.alarms import AlarmLevel
from tui_gcs.core.protocol.bus import REQUEST
from tui_gcs.core.protocol.common import Phase, RunPhase
from tui_gcs.core.protocol.services import PlanRow, ServiceReply, SetParams, UploadPlan

pytestmark = pytest.mark.long  # nearly each is a flight

MakeRig = Callable[..., Rig]
HOUSEKEEPING = {511, 512}
"""Requests for rates and for information."""


def killed_in_flight(rig: MakeRig, path: Path) -> Rig:
    flight = rig(3).flying().run(8.0)
    assert flight.ask(m.SwitchRound(index=1)).ok
    flight.run(6.0)
    StateStore(path).remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(path))
    return flight


def moving_commands(flight: Rig, since_s: float) -> list[str]:
    sent = [(n, f) for t, _, n, f in flight.sent if t > since_s and n != "TIMESYNC"]
    return [name for name, fields in sent if fields.get("command") not in HOUSEKEEPING]


def test_a_restarted_station_shows_all_as_holding_and_sends_nothing_that_moves(rig: MakeRig, tmp_path: Path) -> None:
    flight = killed_in_flight(rig, tmp_path / "memory.json")
    killed = flight.clock.now()
    flight.run(30.0)
    assert flight.phases() == {Phase.HOLDING}
    assert flight.station.flight.executive.run is RunPhase.HOLD
    assert moving_commands(flight, killed) == []
    assert all(flight.speed(v) < 0.3 for v in flight.ids), "each flew to its last target and stays"
    found = [t for t in flight.texts() if "found in the air: nothing" in t]
    assert found == ["found in the air: nothing is sent to it until resume or return"] * 3
    alarms = {alarm.cause: (alarm.level, alarm.state, alarm.vehicles) for alarm in flight.station.alarms.alarms()}
    assert alarms == {"found": (AlarmLevel.CAUTION, "new", (1, 2, 3))}, "nobody asked for this hold: it must be seen"


def test_it_remembers_round_teams_and_mission_clock(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(3).flying()
    started = flight.station.flight.executive.started_s
    layers = {f.vehicle: (f.team, f.layer_m, f.home_m) for f in flight.station.flight.flights}
    flight.ask(m.SwitchRound(index=2))
    revision = flight.station.active.team_controllers["defend"].task.revision  # type: ignore[union-attr]
    StateStore(tmp_path / "memory.json").remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(tmp_path / "memory.json"))
    flight.run(5.0)
    assert flight.station.active.round.name == "round 3"
    assert flight.station.flight.executive.started_s == started
    assert {f.vehicle: (f.team, f.layer_m, f.home_m) for f in flight.station.flight.flights} == layers
    assert flight.station.active.team_controllers["defend"].task.revision > revision  # type: ignore[union-attr]


def test_resume_goes_on_with_the_planner(rig: MakeRig, tmp_path: Path) -> None:
    flight = killed_in_flight(rig, tmp_path / "memory.json").run(5.0)
    assert flight.ask(m.Resume()).ok
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.RUNNING, 20.0)
    flight.run(40.0)
    assert flight.phases() == {Phase.FLYING}
    assert flight.place(2)[:2] == pytest.approx((240.0, 200.0), abs=1.0)


def test_planners_are_told_what_flies_before_the_operator_resumes(rig: MakeRig, tmp_path: Path) -> None:
    flight = killed_in_flight(rig, tmp_path / "memory.json")
    task = flight.station.active.team_controllers["defend"].task
    assert task is not None
    assert task.off_course_m == UNKNOWN_OFF_COURSE_M, "nobody was heard yet"
    task = flight.run(5.0).station.active.team_controllers["defend"].task
    assert task is not None
    assert task.off_course_m == ArduCopter.off_course_m
    revision = task.revision
    assert flight.ask(m.Resume()).ok
    flight.run(30.0)
    task = flight.station.active.team_controllers["defend"].task
    assert task is not None
    assert task.revision == revision, "who flies is not disturbed"


def test_return_lands_at_the_original_places(rig: MakeRig, tmp_path: Path) -> None:
    flight = killed_in_flight(rig, tmp_path / "memory.json").run(5.0)
    assert flight.ask(m.Return()).ok
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.IDLE, 150.0)
    for v, y in ((1, 170.0), (2, 190.0), (3, 210.0)):
        assert math.dist(flight.place(v)[:2], (45.0, y)) <= 1.0
    assert not flight.sim.armed.any()


def test_without_a_memory_the_vehicles_own_home_will_do(rig: MakeRig, tmp_path: Path) -> None:
    """State on disk is gone: nothing is flown until somebody says so; where home is, the autopilot may know."""
    flight = rig(2).flying().run(5.0)
    flight.restart_station(StateStore(tmp_path / "never-written.json"))
    flight.run(6.0)
    assert flight.phases() == {Phase.HOLDING}
    reply = flight.ask(m.Return())
    for result in reply.results:
        assert result.ok or result.text == "has no home"


def test_a_memory_that_cannot_be_read_is_as_if_it_were_not(rig: MakeRig, tmp_path: Path) -> None:
    """One station after the other finds another one."""
    path = tmp_path / "memory.json"
    flight = rig(1).ready()
    for text in ("", "{", "[]", "null", "{}", '{"toml": "x"}', '{"flights": 3}', "\x00\xff"):
        path.write_text(text, encoding="latin-1")
        flight.restart_station(StateStore(path))
        flight.run(3.0)
        assert flight.station.active.round_index == 0 and set(flight.station.flight.flights.by_id) == {1}, text
        causes = [alarm.cause for alarm in flight.station.alarms.alarms()]
        assert causes == ["memory"], f"what it shows is not what was flown: {text}"


@pytest.mark.parametrize("key", ["flights", "round_index", "alarms", "acknowledged", "plans", "reboots"])
def test_a_memory_with_wrong_things_in_it_keeps_no_station_from_its_vehicles(
    rig: MakeRig, tmp_path: Path, key: str
) -> None:
    flight = rig(2).flying()
    path = tmp_path / "memory.json"
    StateStore(path).remember(flight.station.parts, flight.station.frontend)
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: [{"x": "y"}]}))
    flight.restart_station(StateStore(path))
    flight.run(6.0)
    assert flight.phases() == {Phase.HOLDING}
    alarms = {alarm.cause: alarm for alarm in flight.station.alarms.alarms()}
    assert set(alarms) == {"found", "memory"} and "it is damaged" in alarms["memory"].text
    assert flight.ask(m.Resume()).ok
    StateStore(path).remember(flight.station.parts, flight.station.frontend)
    flight.run(6.0)
    assert {a.cause for a in flight.station.alarms.alarms() if a.state != "over"} == set()


def test_memory_is_written_only_when_something_changed(rig: MakeRig, tmp_path: Path) -> None:
    path = tmp_path / "memory.json"
    memory = StateStore(path)
    flight = rig(1).ready()
    memory.remember(flight.station.parts, flight.station.frontend)
    held = json.loads(path.read_text())
    assert held["flights"][0]["vehicle"] == 1 and "[[round]]" in held["toml"]
    path.unlink()
    memory.remember(flight.station.parts, flight.station.frontend)
    assert not path.exists()
    flight.ask(m.SwitchRound(index=1))
    memory.remember(flight.station.parts, flight.station.frontend)
    assert json.loads(path.read_text())["round_index"] == 1
    assert list(tmp_path.glob("*.new")) == []


def test_a_disk_that_is_full_does_not_hurt_the_flight(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(1).ready()
    StateStore(tmp_path / "no" / "such" / "directory" / "memory.json").remember(
        flight.station.parts, flight.station.frontend
    )
    flight.run(1.0)
    assert flight.phases() == {Phase.GROUND}


def test_what_could_not_be_kept_is_told_and_kept_when_there_is_room(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(1).ready()
    folder = tmp_path / "later"
    memory = StateStore(folder / "memory.json")
    memory.remember(flight.station.parts, flight.station.frontend)
    flight.run(1.0)
    (alarm,) = flight.station.alarms.alarms()
    assert alarm.cause == "recording" and "No such file" in alarm.text
    folder.mkdir()
    memory.remember(flight.station.parts, flight.station.frontend)
    assert not (folder / "memory.json").exists(), "not tried again at every tick"
    flight.run(2.0)
    memory.remember(flight.station.parts, flight.station.frontend)
    assert (folder / "memory.json").exists() and flight.station.conditions.memory_error == ""


def test_a_vehicle_in_its_pilots_mode_is_found_but_not_taken(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(2).flying().run(5.0)
    StateStore(tmp_path / "memory.json").remember(flight.station.parts, flight.station.frontend)
    flight.pilot(2, 5)
    flight.restart_station(StateStore(tmp_path / "memory.json"))
    flight.run(8.0)
    assert (flight.phase(1), flight.phase(2)) == (Phase.HOLDING, Phase.TAKEN_OUT)
    flight.ask(m.Resume())
    flight.run(10.0)
    assert int(flight.sim.mode[1]) == 5


def test_a_scenario_may_say_that_a_restarted_station_resumes(rig: MakeRig, tmp_path: Path) -> None:
    whole = scenario(2)
    loss = msgspec.structs.replace(whole.link_loss, resume=True)
    flight = rig(mission=msgspec.structs.replace(whole, link_loss=loss)).flying().run(8.0)
    assert flight.ask(m.Return(vehicles=(1,))).ok
    flight.run(1.0)
    StateStore(tmp_path / "memory.json").remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(tmp_path / "memory.json"))
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.RUNNING, 20.0)
    flight.until(lambda: flight.phase(2) is Phase.FLYING, 20.0)
    flight.run(30.0)
    assert flight.place(2)[:2] == pytest.approx((240.0, 200.0), abs=1.0)
    assert flight.phase(1) is Phase.HOLDING, "it was on its way home before: not into flight again by itself"


def test_a_link_that_fails_and_works_again_is_told_and_counted(rig: MakeRig) -> None:
    flight = rig(1).ready()
    flight.link.error = "cable pulled"
    flight.run(1.0)
    flight.link.error = ""
    flight.run(1.0)
    assert flight.texts("link memory") == ["cable pulled", "works again"]
    assert flight.station.publisher.status().faults == {"link": 1}


def test_what_was_answered_stays_answered_and_nothing_is_new(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(3).flying()
    silent = {1, 2}
    flight.loses = lambda way, index: way == "up" and index in silent
    flight.run(6.0)
    raised = {alarm.cause: alarm.raised for alarm in flight.station.alarms.alarms()}
    assert flight.ask(m.Acknowledge(raised=raised)).ok
    StateStore(tmp_path / "memory.json").remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(tmp_path / "memory.json"))
    flight.run(20.0)
    lost = next(alarm for alarm in flight.station.alarms.alarms() if alarm.cause == "lost")
    assert (lost.state, lost.vehicles, lost.raised) == ("acknowledged", (2, 3), raised["lost"])
    reported = flight.texts("alarm")  # nor is it lost, or has left, because it was not heard in the first moment
    assert reported == ["found in the air: vehicle 1  now round 1"]
    silent.add(0)
    flight.run(6.0)
    lost = next(alarm for alarm in flight.station.alarms.alarms() if alarm.cause == "lost")
    assert (lost.state, lost.fresh) == ("new", (1,))
    assert lost.raised > raised["lost"], "numbers go on: a console that had the old ones knows that it is new"


def test_what_planners_learnt_is_known_to_the_next_stations_workers(rig: MakeRig, tmp_path: Path) -> None:
    """Without it a patrol began at full speed again, and was blown 6 to 8 m beside its way until it had slowed anew."""
    path = tmp_path / "memory.json"
    flight = rig(2).flying()
    flight.plan(learnt=b"slow in this wind", snapshot=b"all of it")
    flight.run(0.1)
    StateStore(path).remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(path))
    for _ in range(2):  # the next one may be killed before its planners have said anything
        assert flight.ask(m.GetTask(team="defend")).snapshot == b"slow in this wind", "also when tasks change"
        flight.run(3.0)
    StateStore(path).remember(flight.station.parts, flight.station.frontend)
    held = json.loads(path.read_text())
    for damaged in (
        {"defend": "?"},
        {"defend": 3},
        ["defend"],
        "x",
        {"defend": "AA" * 50_000},
        {"attack": "AAAA"},
        None,
    ):
        path.write_text(json.dumps(held | {"learnt": damaged}))
        flight.restart_station(StateStore(path))
        assert flight.ask(m.GetTask(team="defend")).snapshot == b""
        assert set(flight.station.flight.flights.by_id) == {1, 2} and flight.station.conditions.memory_lost == "", (
            "nothing else is lost"
        )
    del held["learnt"]
    path.write_text(json.dumps(held))
    flight.restart_station(StateStore(path))
    assert set(flight.station.flight.flights.by_id) == {1, 2} and flight.station.conditions.memory_lost == "", (
        "of a station of before"
    )


def test_what_was_over_and_nobody_saw_is_still_told(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(2).flying()
    silent = {1}
    flight.loses = lambda way, index: way == "up" and index in silent
    flight.run(6.0)
    silent.clear()
    flight.run(6.0)
    StateStore(tmp_path / "memory.json").remember(flight.station.parts, flight.station.frontend)
    flight.restart_station(StateStore(tmp_path / "memory.json"))
    flight.run(5.0)
    assert [alarm.state for alarm in flight.station.alarms.alarms() if alarm.cause == "lost"] == ["over"]


def test_who_must_be_rebooted_is_remembered_until_it_has_been(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(2).ready()
    flight.station.picture.fleet.vehicles[1].reboot_first = "airframe changed"
    flight.run(1.0)
    StateStore(tmp_path / "memory.json").remember(flight.station.parts, flight.station.frontend)
    for rebooted in (False, True):
        if rebooted:
            flight.sim._pilots[0].restart(flight.sim._now_us)
        flight.restart_station(StateStore(tmp_path / "memory.json"))
        flight.run(20.0)
        why = "" if rebooted else "airframe changed: reboot it before it flies"
        assert flight.station.picture.fleet.vehicles[1].why_not_started == why
        assert flight.station.picture.fleet.vehicles[2].why_not_started == ""


WAYS = tuple(PlanRow(16, 3, (0.0, 0.0, 0.0, 0.0), 520_730_000 + 10 * i, -6_270_000, 40.0) for i in range(120))


def change(ground: Rig, request: UploadPlan | SetParams) -> ServiceReply:
    return m.decode(ground.bus.ask(REQUEST.format(principal="cli"), m.encode(request)), ServiceReply)


def test_what_was_being_changed_is_told_and_is_not_taken_for_whole(rig: MakeRig, tmp_path: Path) -> None:
    """A real ArduCopter then held 161 of 399 items, and nobody said a word."""
    ground, path = rig(2).ready(), tmp_path / "memory.json"
    assert change(ground, UploadPlan(vehicles=(1,), kind="mission", items=WAYS)).ok
    ground.run(0.5)
    StateStore(path).remember(ground.station.parts, ground.station.frontend)
    ground.restart_station(StateStore(path))
    ground.run(12.0)
    registry = ground.station.services.missions.registry
    assert 0 < registry.state(1).total < 120, "the beginning of it"
    reported = "upload mission of 120 items: cut short when the station ended"
    assert any(text.startswith(reported) for text in ground.texts("vehicle 1"))
    (alarm,) = (alarm for alarm in ground.station.alarms.alarms() if alarm.cause == "alert")
    assert (alarm.vehicles, alarm.state) == ((1,), "new") and reported in alarm.text
    found = {one.name: one.text for one in plans_on_board(ground.station, ground.station.picture.fleet.vehicles[1])}
    assert found["mission"] == "mission on board was changed: the station ended while it was changing it"
    StateStore(path).remember(ground.station.parts, ground.station.frontend)
    ground.restart_station(StateStore(path))
    ground.run(3.0)
    assert not any(text.startswith(reported) for text in ground.texts("vehicle 1")), "once"
    assert ground.station.services.missions.registry.to_read(1, PlanKind.MISSION), "but it is not forgotten"


def test_a_change_that_was_over_is_not_told(rig: MakeRig, tmp_path: Path) -> None:
    ground, path = rig(1).ready(), tmp_path / "memory.json"
    assert change(ground, SetParams(vehicles=(1,), values={"RTL_ALT": 2500.0})).ok
    StateStore(path).remember(ground.station.parts, ground.station.frontend)
    held = json.loads(path.read_text())
    assert held["unfinished"] == [[1, "set RTL_ALT = 2500"]] and held["changing"] == []
    ground.run(1.0)
    StateStore(path).remember(ground.station.parts, ground.station.frontend)
    assert json.loads(path.read_text())["unfinished"] == []


def test_what_is_to_be_changed_is_written_down_before_that_begins(rig: MakeRig, tmp_path: Path) -> None:
    """As flown: five of 96 parameters had left when the station was killed, and the next one said nothing."""
    ground, path = rig(1).ready(), tmp_path / "memory.json"
    memory = StateStore(path)
    ground.station.frontend.requests.tasks.note = lambda: memory.remember(ground.station.parts, ground.station.frontend)
    assert change(ground, SetParams(vehicles=(1,), values={"RTL_ALT": 2500.0})).ok
    assert json.loads(path.read_text())["unfinished"] == [[1, "set RTL_ALT = 2500"]]
    ground.restart_station(StateStore(path))
    ground.run(3.0)
    assert any(text.startswith("set RTL_ALT = 2500: cut short") for text in ground.texts("vehicle 1"))
