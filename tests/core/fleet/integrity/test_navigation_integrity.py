"""Vehicles that report bad navigation: reported at once and not led on."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from unittest.mock import patch

from sitl.ardupilot.telemetry import CopterTelemetry
from tests.core.rigs.rig import Rig
from tui_gcs.core.fleet.integrity.navigation_integrity import NavigationIntegrityMonitor
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase

MakeRig = Callable[..., Rig]
GLITCH = "GPS glitch: its position may jump to a wrong place within seconds"


@contextmanager
def gps_off(flight: Rig, *vehicles: int, flags: int = 0x833F) -> Iterator[None]:
    """What the EKFs of these say as long as their GPS is elsewhere, as a real ArduCopter's did."""
    well = CopterTelemetry.BUILDERS["EKF_STATUS_REPORT"]
    ill = {"flags": flags, "pos_horiz_variance": 17.4}

    def built(telemetry: CopterTelemetry) -> dict[str, float] | None:
        return ill if telemetry.spec.system_id in vehicles else well(telemetry)

    with patch.dict(CopterTelemetry.BUILDERS, EKF_STATUS_REPORT=built):
        yield


def alarm(flight: Rig, cause: str = "position") -> str:
    """The words of an alarm that is up, "" if it is not."""
    up = [alarm for alarm in flight.station.alarms.alarms() if alarm.cause == cause and alarm.state != "over"]
    return up[0].words() if up else ""


def says(flight: Rig, vehicle: int, text: str) -> None:
    flight.say("STATUSTEXT", vehicle, severity=2, text=text)


def test_a_doubt_counts_when_it_has_lasted_and_once() -> None:
    monitor, why = NavigationIntegrityMonitor(), {3: "GPS glitch"}
    assert [monitor.look(why, t) for t in (0.0, 1.0, 1.8)] == [[], [], []]
    assert monitor.look({}, 1.9) == [] and monitor.look(why, 2.0) == [], "it was sure meanwhile"
    assert monitor.look(why, 4.0) == monitor.look(why, 4.2) == [(3, "GPS glitch")], "until it is answered"
    monitor.answer(3)
    assert monitor.look(why, 5.0) == []
    assert monitor.look({}, 9.0) == monitor.look(why, 9.5) == monitor.look(why, 12.0) == [], "the same finding"
    assert monitor.look({}, 17.1) == monitor.look(why, 17.2) == [] and monitor.look(why, 19.2) == [(3, "GPS glitch")]


def test_who_doubts_its_position_holds_before_that_jumps(rig: MakeRig) -> None:
    """As flown: a real ArduCopter's planner led it on for 10 s after it had said so, and then 67 m beside its way."""
    flight = rig(2).flying().run(10.0)
    with gps_off(flight, 1):
        took_s = flight.until(lambda: flight.phase(1) is Phase.HOLDING, 5.0, "it holds")
        assert took_s > 2.0, "one report alone is none"
        assert alarm(flight) == f"position not known: vehicle 1  {GLITCH}"
        assert f"it doubts its own position, and holds: {GLITCH}" in flight.texts("vehicle 1")
        assert flight.phase(2) is Phase.FLYING
        flight.until(lambda: flight.speed(1) < 0.5, 8.0, "it stands")
        (result,) = flight.ask(m.Resume()).results
        assert result.text == "it doubted its own position: resume it by name"
        assert flight.ask(m.Resume(vehicles=(1,))).ok, "who looks at it may know better"
        flight.until(lambda: flight.phase(1) is Phase.FLYING, 20.0, "it flies")
        flight.run(10.0)
        assert flight.phase(1) is Phase.FLYING, "and is not asked again"
    flight.run(15.0)
    assert not alarm(flight)


def test_one_report_out_of_line_holds_nobody(rig: MakeRig) -> None:
    flight = rig(2).flying().run(10.0)
    with gps_off(flight, 1, 2):
        flight.run(1.0)
    flight.run(10.0)
    assert flight.phases() == {Phase.FLYING}


def test_a_doubt_in_the_climb_counts_when_the_planner_would_lead_it(rig: MakeRig) -> None:
    flight = rig(2).flying()
    assert flight.ask(m.Return()).ok
    flight.until(lambda: flight.phases() == {Phase.GROUND}, 120.0, "down")
    assert flight.ask(m.Start(vehicles=(1, 2))).ok
    flight.until(lambda: flight.phase(1) is Phase.TAKEOFF and flight.place(1)[2] > 5.0, 30.0, "it climbs")
    with gps_off(flight, 1):
        flight.until(lambda: flight.phase(2) is Phase.FLYING, 60.0, "the other flies")
        flight.run(1.0)
        assert flight.phase(1) is Phase.HOLDING


def test_a_glitch_is_on_the_alarm_line_as_soon_as_it_is_told(rig: MakeRig) -> None:
    """As seen: up to 3 s, while what its EKF said hid it before that was an alarm itself."""
    flight = rig(2).flying().run(10.0)
    with gps_off(flight, 1, flags=0x33F):
        flight.until(lambda: bool(flight.station._alarm_finder.in_doubt), 3.0, "found")
        assert not alarm(flight)
        says(flight, 1, "GPS Glitch or Compass error")
        flight.run(0.5)
        assert alarm(flight) == f"position not known: vehicle 1  {GLITCH}"


def test_a_glitch_that_a_slow_radio_tells_by_its_text_alone(rig: MakeRig) -> None:
    flight = rig(2).flying().run(10.0)
    says(flight, 1, "GPS Glitch or Compass error")
    flight.run(3.0)
    assert flight.phase(1) is Phase.HOLDING
    assert alarm(flight) == f"position not known: vehicle 1  {GLITCH}"
    says(flight, 1, "Glitch cleared")
    flight.run(6.0)
    assert not alarm(flight)
