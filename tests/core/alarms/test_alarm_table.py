"""Alarms: what is wrong now becomes what is shown, acknowledged, over, shelved; one line for each cause."""

import pytest

from tui_gcs.core.alarms.alarm_table import AlarmFinding, AlarmTable
from tui_gcs.core.alarms.causes import BY_ID, CAUSES, RANK
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol.alarms import AlarmLevel, action_words
from tui_gcs.core.protocol.common import Acknowledge, Alarm, EventClass, Shelve, Unshelve
from tui_gcs.core.records.event_log import ALERT, CRITICAL, EMERGENCY, EventLog


class Desk:
    """An alarm desk that looks twice a second."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.events = EventLog(self.clock)
        self.desk = AlarmTable(self.clock, self.events)
        self.events.listen(lambda event: self.desk.on_event(event, {}))

    def look(self, *findings: AlarmFinding, seconds: float = 0.5) -> None:
        """These are wrong for so long."""
        for _ in range(round(seconds / 0.5)):
            self.clock.advance(0.5)
            self.desk.look(findings)

    def shown(self) -> list[str]:
        """State and words of all alarms."""
        return [f"{alarm.state} {alarm.words()}" for alarm in self.desk.alarms()]

    def only(self) -> Alarm:
        """The only alarm."""
        (alarm,) = self.desk.alarms()
        return alarm

    def only_of(self, cause: str) -> Alarm:
        """The only one of that cause."""
        (alarm,) = (alarm for alarm in self.desk.alarms() if alarm.cause == cause)
        return alarm

    def acknowledge(self, *causes: str) -> bool:
        """As a console does with what it shows now."""
        raised = {alarm.cause: alarm.raised for alarm in self.desk.alarms() if alarm.cause in causes}
        return self.desk.acknowledge("console-1", Acknowledge(raised=raised)).ok

    def history(self) -> list[str]:
        """What the journal has of alarms."""
        return [f"{e.source}: {e.text}" for e in self.events.since(0) if e.cls is EventClass.ALARM]


@pytest.fixture
def desk() -> Desk:
    """Nothing is wrong."""
    return Desk()


def lost(*vehicles: int) -> list[AlarmFinding]:
    """These are lost."""
    return [AlarmFinding("lost", vehicle) for vehicle in vehicles]


def test_eight_vehicles_with_one_trouble_are_one_alarm(desk: Desk) -> None:
    desk.look(*(AlarmFinding("position", v, "no GPS fix") for v in range(1, 9)), seconds=2.0)
    assert desk.shown() == ["new position not known: vehicles 1-8  no GPS fix"]
    assert desk.history() == ["alarm: position not known: vehicles 1-8  no GPS fix"]


def test_acknowledged_is_not_over_and_over_is_not_acknowledged(desk: Desk) -> None:
    desk.look(*lost(5))
    assert desk.acknowledge("lost")
    assert desk.shown() == ["acknowledged LOST in the air: vehicle 5"]
    assert desk.only().by == "console-1"
    desk.look(seconds=5.0)
    assert desk.shown() == []
    desk.look(*lost(6))
    desk.look(seconds=5.0)
    assert desk.shown() == ["over LOST in the air: vehicle 6"]
    assert desk.acknowledge("lost")
    assert desk.shown() == []
    assert desk.history()[-2:] == [
        "alarm: over: LOST in the air: vehicle 6",
        "console-1: acknowledged: LOST in the air: vehicle 6",
    ]


def test_who_joins_after_the_screen_was_drawn_stays_new(desk: Desk) -> None:
    desk.look(*lost(5))
    seen = {"lost": desk.only().raised}
    desk.look(*lost(5, 7))
    assert desk.desk.acknowledge("console-1", Acknowledge(raised=seen)).ok
    alarm = desk.only()
    assert (alarm.state, alarm.vehicles, alarm.fresh) == ("new", (5, 7), (7,))
    assert not desk.desk.acknowledge("console-1", Acknowledge(raised=seen)).ok


def test_in_a_failsafe_what_is_worse_is_told_all_the_same(desk: Desk) -> None:
    """Seen: a real one on its way home by its battery failsafe lost thrust, and no alarm said so."""
    desk.look(AlarmFinding("failsafe", 4, "RTL: Battery Failsafe"))
    desk.events.report(EventClass.MISSION, "vehicle 4", "Potential Thrust Loss (3)", EMERGENCY)
    desk.look(AlarmFinding("failsafe", 4, "RTL: Battery Failsafe"))
    assert desk.shown() == [
        "new FAILSAFE on board: vehicle 4  RTL: Battery Failsafe",
        "new ALERT: vehicle 4  Potential Thrust Loss (3)",
    ]


def test_what_follows_from_a_loss_is_not_told_and_comes_back_as_it_was(desk: Desk) -> None:
    low = AlarmFinding("battery-low", 5, "22 %")
    desk.look(low, seconds=3.0)
    desk.acknowledge("battery-low")
    desk.look(*lost(5), low, AlarmFinding("stale", 5))
    assert desk.shown() == ["new LOST in the air: vehicle 5"]
    desk.look(*lost(5), seconds=30.0)  # its battery is not even known
    desk.acknowledge("lost")
    desk.look(low, seconds=5.0)
    assert desk.shown() == ["acknowledged battery low: vehicle 5  22 %"]


def test_another_vehicle_is_not_hidden_by_a_loss(desk: Desk) -> None:
    desk.look(*lost(5), AlarmFinding("battery-low", 6, "22 %"), seconds=3.0)
    assert desk.shown() == ["new LOST in the air: vehicle 5", "new battery low: vehicle 6  22 %"]


def test_short_trouble_does_not_ring_and_flutter_rings_once(desk: Desk) -> None:
    weak = AlarmFinding("poor-link", 3, "30 %")
    desk.look(weak, seconds=4.0)
    desk.look(seconds=1.0)
    assert desk.shown() == []
    desk.look(weak, seconds=6.0)
    for _ in range(20):  # never away for the ten seconds that end it
        desk.look(seconds=5.0)
        desk.look(weak, seconds=5.0)
    assert len(desk.history()) == 1


def test_what_comes_back_and_back_is_kept_longer(desk: Desk) -> None:
    for _ in range(6):
        desk.look(*lost(3), seconds=1.0)
        desk.look(seconds=7.0)  # over after 2 s at first
    assert len([line for line in desk.history() if line == "alarm: LOST in the air: vehicle 3"]) == 3


def test_the_worst_that_holds_comes_first_then_what_is_over_then_what_is_only_to_be_known(desk: Desk) -> None:
    """What was over stood before a critical battery that somebody had seen, an hour ago."""
    found = [
        AlarmFinding("recording", "station", "disk full"),
        AlarmFinding("outside", 2, "by 4 m"),
        AlarmFinding("hold", 1),
    ]
    found += [AlarmFinding("stop", 4), AlarmFinding("link", "radio")]
    desk.look(*found, *lost(9), seconds=2.0)
    desk.look(*found, seconds=3.0)
    desk.acknowledge("stop", "link")
    link = desk.only_of("link")
    assert desk.desk.shelve("console-1", Shelve(raised={"link": link.raised}, minutes=5.0)).ok
    in_turn = [(alarm.cause, alarm.state) for alarm in desk.desk.alarms()]
    assert in_turn == [
        ("outside", "new"),
        ("stop", "acknowledged"),
        ("recording", "new"),
        ("lost", "over"),
        ("hold", "acknowledged"),
        ("link", "shelved"),
    ]


def test_what_to_do_is_for_those_of_whom_it_is_true(desk: Desk) -> None:
    down = [AlarmFinding("battery-critical", v, "9 %, landing", action="it lands") for v in (3, 4)]
    desk.look(*down, seconds=2.0)
    assert desk.only().action == "it lands"
    desk.look(*down, AlarmFinding("battery-critical", 7, "14 %"), seconds=2.0)
    own = BY_ID["battery-critical"].action
    assert (desk.only().vehicles, desk.only().action) == ((3, 4, 7), f"vehicle 7: {own}")
    desk.look(AlarmFinding("battery-critical", 3, "9 %"), AlarmFinding("battery-critical", 7, "14 %"), seconds=4.0)
    assert (desk.only().vehicles, desk.only().action) == ((3, 7), own), "it does something else now"


def test_an_advisory_goes_by_itself(desk: Desk) -> None:
    desk.look(AlarmFinding("hold", 1), AlarmFinding("hold", 2))
    assert desk.shown() == ["acknowledged HOLD: vehicles 1-2"]
    desk.look(seconds=1.0)
    assert desk.shown() == []


def test_shelving_has_a_limit_and_hides_only_who_was_there(desk: Desk) -> None:
    def shelve(minutes: float) -> str:
        reply = desk.desk.shelve("console-1", Shelve(raised={"lost": desk.desk.alarms()[0].raised}, minutes=minutes))
        return reply.text if not reply.ok else ""

    desk.look(*lost(5))
    assert shelve(6.0) == "LOST in the air: may be shelved for 5 min at most"
    assert shelve(float("nan")) and shelve(-1.0)
    assert shelve(5.0) == ""
    desk.look(*lost(5, 6))
    assert desk.shown() == ["new LOST in the air: vehicle 6", "shelved LOST in the air: vehicle 5"]
    desk.look(*lost(5), seconds=301.0)
    desk.acknowledge("lost")
    assert "alarm: shelved no longer: LOST in the air: vehicle 5" in desk.history()
    shelve(5.0)
    assert desk.desk.unshelve("console-1", Unshelve(causes=("lost",))).ok
    assert desk.shown() == ["new LOST in the air: vehicle 5"]


def test_a_minute_is_enough_to_shelve_and_none_is_not(desk: Desk) -> None:
    desk.look(*lost(5))
    raised = {"lost": desk.only().raised}
    assert not desk.desk.shelve("console-1", Shelve(raised=raised, minutes=0.0)).ok
    reply = desk.desk.shelve("console-1", Shelve(raised=raised, minutes=0.5))
    assert (reply.ok, reply.text) == (True, "shelved for 0.5 min: LOST in the air: vehicle 5")


def test_a_number_that_changes_rings_no_second_time(desk: Desk) -> None:
    desk.look(AlarmFinding("battery-low", 5, "22 %"), seconds=3.0)
    reply = desk.desk.acknowledge("console-1", Acknowledge(raised={"battery-low": desk.only().raised}))
    assert reply.text == "acknowledged: battery low: vehicle 5  22 %"
    desk.look(AlarmFinding("battery-low", 5, "21 %"))
    assert desk.shown() == ["acknowledged battery low: vehicle 5  21 %"]


def test_after_a_restart_of_the_station_nothing_is_new_that_was_seen(desk: Desk) -> None:
    wrong = [*lost(5), AlarmFinding("battery-low", 6, "22 %"), AlarmFinding("outside", 7, "by 4 m")]
    desk.look(*wrong, seconds=3.0)
    desk.acknowledge("lost")
    desk.desk.shelve("console-2", Shelve(raised={"outside": desk.only_of("outside").raised}, minutes=5.0))
    again = Desk()
    again.desk.recall(desk.desk.memory())
    assert (
        again.shown()
        == desk.shown()
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


def test_what_is_told_once_stays_until_it_was_seen(desk: Desk) -> None:
    desk.events.report(EventClass.MISSION, "vehicle 4", "DISARMED outside a landing of ours", ALERT)
    desk.look(seconds=60.0)
    assert desk.shown() == ["over ALERT: vehicle 4  DISARMED outside a landing of ours"]
    assert desk.only().level is AlarmLevel.WARNING


def test_what_a_vehicle_says_on_the_ground_is_no_alarm(desk: Desk) -> None:
    desk.events.report(EventClass.SENSOR, "vehicle 4", "PreArm: Compass not healthy", CRITICAL)
    desk.look()
    assert desk.shown() == []


def test_a_flood_of_texts_from_one_vehicle_is_one_alarm(desk: Desk) -> None:
    for number in range(1000):
        desk.events.report(EventClass.MISSION, "vehicle 4", f"text {number}", CRITICAL)
    desk.look(seconds=1.0)
    assert desk.shown() == ["new it says: vehicle 4  text 999"]


def test_causes_name_each_other_rightly_and_have_tags_that_fit() -> None:
    assert len(RANK) == len(CAUSES)
    assert {effect for cause in CAUSES for effect in cause.hides} <= set(RANK)
    assert max(len(cause.tag) for cause in CAUSES) == 3


def test_actions_show_the_keys_of_the_console() -> None:
    action = "[hold_all] hold all, or [return_and_land] return"
    assert action_words(action, {"hold_all": "!h"}) == "!h hold all, or return"
