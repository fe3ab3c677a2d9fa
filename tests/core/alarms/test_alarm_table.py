"""Alarms: what is wrong now becomes what is shown, acknowledged, over, shelved; one line for each cause."""

import pytest

from tui_gcs.core.alarms.alarm_table import AlarmFinding, AlarmTable
from tui_gcs.core.alarms.causes import BY_ID, CAUSES, RANK
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol.alarms import AlarmLevel, action_words
from tui_gcs.core.protocol.common import Acknowledge, Alarm, EventClass, Shelve, Unshelve
from tui_gcs.core.records.event_log import ALERT, CRITICAL, EMERGENCY, EventLog


class AlarmRig:
    """An alarm table that looks twice a second."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.events = EventLog(self.clock)
        self.table = AlarmTable(self.clock, self.events)
        self.events.listen(lambda event: self.table.on_event(event, {}))

    def look(self, *findings: AlarmFinding, seconds: float = 0.5) -> None:
        """These are wrong for so long."""
        for _ in range(round(seconds / 0.5)):
            self.clock.advance(0.5)
            self.table.look(findings)

    def shown(self) -> list[str]:
        """State and words of all alarms."""
        return [f"{alarm.state} {alarm.words()}" for alarm in self.table.alarms()]

    def only(self) -> Alarm:
        """The only alarm."""
        (alarm,) = self.table.alarms()
        return alarm

    def only_of(self, cause: str) -> Alarm:
        """The only one of that cause."""
        (alarm,) = (alarm for alarm in self.table.alarms() if alarm.cause == cause)
        return alarm

    def acknowledge(self, *causes: str) -> bool:
        """As a console does with what it shows now."""
        raised = {alarm.cause: alarm.raised for alarm in self.table.alarms() if alarm.cause in causes}
        return self.table.acknowledge("console-1", Acknowledge(raised=raised)).ok

    def history(self) -> list[str]:
        """What the journal has of alarms."""
        return [f"{e.source}: {e.text}" for e in self.events.since(0) if e.cls is EventClass.ALARM]


@pytest.fixture
def rig() -> AlarmRig:
    """Nothing is wrong."""
    return AlarmRig()


def lost(*vehicles: int) -> list[AlarmFinding]:
    """These are lost."""
    return [AlarmFinding("lost", vehicle) for vehicle in vehicles]


def test_eight_vehicles_with_one_trouble_are_one_alarm(rig: AlarmRig) -> None:
    rig.look(*(AlarmFinding("position", v, "no GPS fix") for v in range(1, 9)), seconds=2.0)
    assert rig.shown() == ["new position not known: vehicles 1-8  no GPS fix"]
    assert rig.history() == ["alarm: position not known: vehicles 1-8  no GPS fix"]


def test_acknowledged_is_not_over_and_over_is_not_acknowledged(rig: AlarmRig) -> None:
    rig.look(*lost(5))
    assert rig.acknowledge("lost")
    assert rig.shown() == ["acknowledged LOST in the air: vehicle 5"]
    assert rig.only().by == "console-1"
    rig.look(seconds=5.0)
    assert rig.shown() == []
    rig.look(*lost(6))
    rig.look(seconds=5.0)
    assert rig.shown() == ["over LOST in the air: vehicle 6"]
    assert rig.acknowledge("lost")
    assert rig.shown() == []
    assert rig.history()[-2:] == [
        "alarm: over: LOST in the air: vehicle 6",
        "console-1: acknowledged: LOST in the air: vehicle 6",
    ]


def test_who_joins_after_the_screen_was_drawn_stays_new(rig: AlarmRig) -> None:
    rig.look(*lost(5))
    seen = {"lost": rig.only().raised}
    rig.look(*lost(5, 7))
    assert rig.table.acknowledge("console-1", Acknowledge(raised=seen)).ok
    alarm = rig.only()
    assert (alarm.state, alarm.vehicles, alarm.fresh) == ("new", (5, 7), (7,))
    assert not rig.table.acknowledge("console-1", Acknowledge(raised=seen)).ok


def test_in_a_failsafe_what_is_worse_is_told_all_the_same(rig: AlarmRig) -> None:
    """Seen: a real one on its way home by its battery failsafe lost thrust, and no alarm said so."""
    rig.look(AlarmFinding("failsafe", 4, "RTL: Battery Failsafe"))
    rig.events.report(EventClass.MISSION, "vehicle 4", "Potential Thrust Loss (3)", EMERGENCY)
    rig.look(AlarmFinding("failsafe", 4, "RTL: Battery Failsafe"))
    assert rig.shown() == [
        "new FAILSAFE on board: vehicle 4  RTL: Battery Failsafe",
        "new ALERT: vehicle 4  Potential Thrust Loss (3)",
    ]


def test_what_follows_from_a_loss_is_not_told_and_comes_back_as_it_was(rig: AlarmRig) -> None:
    low = AlarmFinding("battery-low", 5, "22 %")
    rig.look(low, seconds=3.0)
    rig.acknowledge("battery-low")
    rig.look(*lost(5), low, AlarmFinding("stale", 5))
    assert rig.shown() == ["new LOST in the air: vehicle 5"]
    rig.look(*lost(5), seconds=30.0)  # its battery is not even known
    rig.acknowledge("lost")
    rig.look(low, seconds=5.0)
    assert rig.shown() == ["acknowledged battery low: vehicle 5  22 %"]


def test_another_vehicle_is_not_hidden_by_a_loss(rig: AlarmRig) -> None:
    rig.look(*lost(5), AlarmFinding("battery-low", 6, "22 %"), seconds=3.0)
    assert rig.shown() == ["new LOST in the air: vehicle 5", "new battery low: vehicle 6  22 %"]


def test_short_trouble_does_not_ring_and_flutter_rings_once(rig: AlarmRig) -> None:
    weak = AlarmFinding("poor-link", 3, "30 %")
    rig.look(weak, seconds=4.0)
    rig.look(seconds=1.0)
    assert rig.shown() == []
    rig.look(weak, seconds=6.0)
    for _ in range(20):  # never away for the ten seconds that end it
        rig.look(seconds=5.0)
        rig.look(weak, seconds=5.0)
    assert len(rig.history()) == 1


def test_what_comes_back_and_back_is_kept_longer(rig: AlarmRig) -> None:
    for _ in range(6):
        rig.look(*lost(3), seconds=1.0)
        rig.look(seconds=7.0)  # over after 2 s at first
    assert len([line for line in rig.history() if line == "alarm: LOST in the air: vehicle 3"]) == 3


def test_the_worst_that_holds_comes_first_then_what_is_over_then_what_is_only_to_be_known(rig: AlarmRig) -> None:
    """What was over stood before a critical battery that somebody had seen, an hour ago."""
    found = [
        AlarmFinding("recording", "station", "disk full"),
        AlarmFinding("outside", 2, "by 4 m"),
        AlarmFinding("hold", 1),
    ]
    found += [AlarmFinding("stop", 4), AlarmFinding("link", "radio")]
    rig.look(*found, *lost(9), seconds=2.0)
    rig.look(*found, seconds=3.0)
    rig.acknowledge("stop", "link")
    link = rig.only_of("link")
    assert rig.table.shelve("console-1", Shelve(raised={"link": link.raised}, minutes=5.0)).ok
    in_turn = [(alarm.cause, alarm.state) for alarm in rig.table.alarms()]
    assert in_turn == [
        ("outside", "new"),
        ("stop", "acknowledged"),
        ("recording", "new"),
        ("lost", "over"),
        ("hold", "acknowledged"),
        ("link", "shelved"),
    ]


def test_what_to_do_is_for_those_of_whom_it_is_true(rig: AlarmRig) -> None:
    down = [AlarmFinding("battery-critical", v, "9 %, landing", action="it lands") for v in (3, 4)]
    rig.look(*down, seconds=2.0)
    assert rig.only().action == "it lands"
    rig.look(*down, AlarmFinding("battery-critical", 7, "14 %"), seconds=2.0)
    own = BY_ID["battery-critical"].action
    assert (rig.only().vehicles, rig.only().action) == ((3, 4, 7), f"vehicle 7: {own}")
    rig.look(AlarmFinding("battery-critical", 3, "9 %"), AlarmFinding("battery-critical", 7, "14 %"), seconds=4.0)
    assert (rig.only().vehicles, rig.only().action) == ((3, 7), own), "it does something else now"


def test_an_advisory_goes_by_itself(rig: AlarmRig) -> None:
    rig.look(AlarmFinding("hold", 1), AlarmFinding("hold", 2))
    assert rig.shown() == ["acknowledged HOLD: vehicles 1-2"]
    rig.look(seconds=1.0)
    assert rig.shown() == []


def test_shelving_has_a_limit_and_hides_only_who_was_there(rig: AlarmRig) -> None:
    def shelve(minutes: float) -> str:
        reply = rig.table.shelve("console-1", Shelve(raised={"lost": rig.table.alarms()[0].raised}, minutes=minutes))
        return reply.text if not reply.ok else ""

    rig.look(*lost(5))
    assert shelve(6.0) == "LOST in the air: may be shelved for 5 min at most"
    assert shelve(float("nan")) and shelve(-1.0)
    assert shelve(5.0) == ""
    rig.look(*lost(5, 6))
    assert rig.shown() == ["new LOST in the air: vehicle 6", "shelved LOST in the air: vehicle 5"]
    rig.look(*lost(5), seconds=301.0)
    rig.acknowledge("lost")
    assert "alarm: shelved no longer: LOST in the air: vehicle 5" in rig.history()
    shelve(5.0)
    assert rig.table.unshelve("console-1", Unshelve(causes=("lost",))).ok
    assert rig.shown() == ["new LOST in the air: vehicle 5"]


def test_a_minute_is_enough_to_shelve_and_none_is_not(rig: AlarmRig) -> None:
    rig.look(*lost(5))
    raised = {"lost": rig.only().raised}
    assert not rig.table.shelve("console-1", Shelve(raised=raised, minutes=0.0)).ok
    reply = rig.table.shelve("console-1", Shelve(raised=raised, minutes=0.5))
    assert (reply.ok, reply.text) == (True, "shelved for 0.5 min: LOST in the air: vehicle 5")


def test_a_number_that_changes_rings_no_second_time(rig: AlarmRig) -> None:
    rig.look(AlarmFinding("battery-low", 5, "22 %"), seconds=3.0)
    reply = rig.table.acknowledge("console-1", Acknowledge(raised={"battery-low": rig.only().raised}))
    assert reply.text == "acknowledged: battery low: vehicle 5  22 %"
    rig.look(AlarmFinding("battery-low", 5, "21 %"))
    assert rig.shown() == ["acknowledged battery low: vehicle 5  21 %"]


def test_after_a_restart_of_the_station_nothing_is_new_that_was_seen(rig: AlarmRig) -> None:
    wrong = [*lost(5), AlarmFinding("battery-low", 6, "22 %"), AlarmFinding("outside", 7, "by 4 m")]
    rig.look(*wrong, seconds=3.0)
    rig.acknowledge("lost")
    rig.table.shelve("console-2", Shelve(raised={"outside": rig.only_of("outside").raised}, minutes=5.0))
    again = AlarmRig()
    again.table.recall(rig.table.memory())
    assert (
        again.shown()
        == rig.shown()
        == [
            "acknowledged LOST in the air: vehicle 5",
            "new battery low: vehicle 6  22 %",
            "shelved OUTSIDE the area: vehicle 7  by 4 m",
        ]
    )
    assert (again.only_of("lost").by, again.only_of("outside").by) == ("console-1", "console-2")
    again.look(seconds=14.5)
    assert len(again.shown()) == 3, "nobody has been heard yet"
    again.look(*lost(8), seconds=5.0)
    assert again.shown() == ["new LOST in the air: vehicle 8", "over battery low: vehicle 6  22 %"]


def test_what_is_told_once_stays_until_it_was_seen(rig: AlarmRig) -> None:
    rig.events.report(EventClass.MISSION, "vehicle 4", "DISARMED, no landing was ordered", ALERT)
    rig.look(seconds=60.0)
    assert rig.shown() == ["over ALERT: vehicle 4  DISARMED, no landing was ordered"]
    assert rig.only().level is AlarmLevel.WARNING


def test_what_a_vehicle_says_on_the_ground_is_no_alarm(rig: AlarmRig) -> None:
    rig.events.report(EventClass.SENSOR, "vehicle 4", "PreArm: Compass not healthy", CRITICAL)
    rig.look()
    assert rig.shown() == []


def test_a_flood_of_texts_from_one_vehicle_is_one_alarm(rig: AlarmRig) -> None:
    for number in range(1000):
        rig.events.report(EventClass.MISSION, "vehicle 4", f"text {number}", CRITICAL)
    rig.look(seconds=1.0)
    assert rig.shown() == ["new it reports: vehicle 4  text 999"]


def test_causes_name_each_other_rightly_and_have_tags_that_fit() -> None:
    assert len(RANK) == len(CAUSES)
    assert {effect for cause in CAUSES for effect in cause.hides} <= set(RANK)
    assert max(len(cause.tag) for cause in CAUSES) == 3


def test_actions_show_the_keys_of_the_console() -> None:
    action = "[hold_all] hold all, or [return_and_land] return"
    assert action_words(action, {"hold_all": "!h"}) == "!h hold all, or return"
