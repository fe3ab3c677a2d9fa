"""What is wrong with one vehicle by its own telemetry: where each limit lies, and what is said."""

import math

import pytest

from tests.core.rigs.heard import ARMED, Heard
from tui_gcs.core.alarms.alarm_table import AlarmTable
from tui_gcs.core.alarms.vehicle_findings import VehicleAlarmMonitor


class Watched:
    """Vehicle 1 in the air, and what is found of it."""

    def __init__(self) -> None:
        self.heard = Heard(**ARMED)
        self.table = AlarmTable(self.heard.clock, self.heard.events)
        self.signs = VehicleAlarmMonitor(self.table)
        self.vehicle = self.heard.is_at(relative_alt=20_000)
        self.vehicle.telemetry.battery_pct, self.vehicle.telemetry.gps_fix = 80.0, 3

    def found(self, *, in_flight: bool = True, failed_link: str = "") -> dict[str, str]:
        """Details by cause; the table knows of them from then on."""
        now = self.heard.clock.now()
        findings = list(self.signs.findings(self.vehicle, now, in_flight=in_flight, failed_link=failed_link))
        self.table.look(findings)
        assert {finding.subject for finding in findings} <= {1}
        return {finding.cause: finding.text for finding in findings}

    def says(self, **beat: int) -> None:
        self.heard.say("HEARTBEAT", **ARMED | beat)
        self.heard.is_at(relative_alt=20_000)


@pytest.fixture
def watched() -> Watched:
    return Watched()


def test_who_is_well_has_nothing(watched: Watched) -> None:
    assert watched.found() == {}


@pytest.mark.parametrize(
    ("charge_pct", "found"),
    [
        (25.0, {}),
        (24.6, {"battery-low": "25 %"}),
        (15.0, {"battery-low": "15 %"}),
        (14.0, {"battery-critical": "14 %"}),
        (0.0, {"battery-critical": "0 %"}),
        (math.nan, {"battery-unknown": ""}),
    ],
)
def test_a_battery_is_low_below_25_and_critical_below_15(
    watched: Watched, charge_pct: float, found: dict[str, str]
) -> None:
    watched.vehicle.telemetry.battery_pct = charge_pct
    assert watched.found() == found
    watched.heard.say("EXTENDED_SYS_STATE", landed_state=1)
    watched.heard.is_at(relative_alt=0)
    assert watched.found() == {}, "on the ground it may be empty"


def test_what_is_up_goes_when_it_is_clearly_better(watched: Watched) -> None:
    for charge_pct, error_m, loss_pct in ((24.0, 11.0, 26.0), (27.0, 8.0, 16.0)):
        watched.vehicle.telemetry.battery_pct, watched.vehicle.integrity.position_error_m = charge_pct, error_m
        watched.vehicle.loss_pct = loss_pct
        for _ in range(60):
            assert set(watched.found()) == {"battery-low", "poor-position", "poor-link"}
            watched.heard.clock.advance(0.05)
            watched.vehicle.telemetry.position_s = watched.heard.clock.now()
            watched.heard.say("HEARTBEAT", **ARMED)
            watched.vehicle.loss_pct = loss_pct
    watched.vehicle.telemetry.battery_pct, watched.vehicle.integrity.position_error_m, watched.vehicle.loss_pct = (
        28.1,
        6.9,
        14.9,
    )
    assert watched.found() == {}


@pytest.mark.parametrize(
    ("error_m", "fix", "found"),
    [
        (10.0, 3, {}),
        (math.nan, 3, {}),
        (10.1, 3, {"poor-position": "±10 m"}),
        (48.0, 3, {"poor-position": "±50 m"}),
        (5e6, 3, {"poor-position": "±1000 m"}),
        (math.inf, 0, {"position": "no GPS fix"}),
        (1.0, 2, {"position": "no GPS fix"}),
        (1.0, 0, {}),  # nobody has told of a fix
    ],
)
def test_a_position_is_poor_from_10_m_on_and_none_without_a_fix(
    watched: Watched, error_m: float, fix: int, found: dict[str, str]
) -> None:
    watched.vehicle.integrity.position_error_m, watched.vehicle.telemetry.gps_fix = error_m, fix
    assert watched.found() == found


@pytest.mark.parametrize(
    ("loss_pct", "found"),
    [
        (25.0, {}),
        (26.0, {"poor-link": "30 % of its frames are lost"}),
        (44.0, {"poor-link": "40 % of its frames are lost"}),
    ],
)
def test_a_link_that_loses_a_quarter_is_poor(watched: Watched, loss_pct: float, found: dict[str, str]) -> None:
    watched.vehicle.loss_pct = loss_pct
    assert watched.found() == found


def test_first_it_is_stale_then_lost_and_a_failed_link_is_named(watched: Watched) -> None:
    for _ in range(31):
        watched.heard.say("HEARTBEAT", **ARMED)
    assert watched.found() == {"stale": ""}
    watched.heard.clock.advance(3.6)
    assert watched.found() == {"lost": ""}
    assert watched.found(failed_link="serial:/dev/ttyUSB0") == {"link-lost": "serial:/dev/ttyUSB0"}
    assert watched.found(in_flight=False) == {}


@pytest.mark.parametrize(
    ("state", "told"),
    [
        (5, "CRITICAL: a failsafe is active"),
        (6, "EMERGENCY: out of control"),
        (8, "flight was TERMINATED"),
    ],
)
def test_a_failsafe_is_what_its_heartbeat_says(watched: Watched, state: int, told: str) -> None:
    watched.says(system_status=state)
    assert watched.found() == {"failsafe": told}
    assert watched.found(in_flight=False) == {}
    watched.says(system_status=4)
    assert watched.found() == {}


def test_why_is_in_its_own_words_as_long_as_it_lasts(watched: Watched) -> None:
    now = watched.heard.clock.now()
    watched.vehicle.recent_reasons = [(now - 1.0, "Radio lost"), (now, "Radio Failsafe")]
    watched.says(system_status=5, custom_mode=6)
    assert watched.found() == {"failsafe": "RTL: Radio lost; Radio Failsafe"}
    watched.vehicle.recent_reasons = []
    watched.heard.clock.advance(2.0)
    watched.says(system_status=5, custom_mode=9)
    watched.heard.clock.advance(2.0)
    watched.says(system_status=5, custom_mode=9)
    reported = watched.found()["failsafe"]
    watched.says(system_status=4)
    watched.found()
    watched.says(system_status=5, custom_mode=9)
    assert (reported, watched.found()["failsafe"]) == (
        "LAND: Radio lost; Radio Failsafe",
        "CRITICAL: a failsafe is active",
    ), "another one, of which it said nothing"


def test_words_that_come_within_three_seconds_are_why_and_later_ones_of_another_failsafe(watched: Watched) -> None:
    watched.says(system_status=5, custom_mode=6)
    assert watched.found() == {"failsafe": "CRITICAL: a failsafe is active"}
    for later_s, words, why in (
        (2.0, "Radio Failsafe", "Radio Failsafe"),
        (9.0, "Crosstrack error", "Radio Failsafe"),
        (9.0, "Battery Failsafe", "Battery Failsafe"),
        (9.0, "Radio Failsafe Cleared", "Battery Failsafe"),
    ):
        watched.heard.clock.advance(later_s)
        watched.vehicle.recent_reasons.append((watched.heard.clock.now(), words))
        watched.says(system_status=5, custom_mode=6)
        assert watched.found() == {"failsafe": f"RTL: {why}"}


def test_after_a_landing_a_failsafe_is_another_one(watched: Watched) -> None:
    watched.vehicle.recent_reasons = [(watched.heard.clock.now(), "Radio Failsafe")]
    watched.says(system_status=5, custom_mode=6)
    assert watched.found() == {"failsafe": "RTL: Radio Failsafe"}
    assert watched.found(in_flight=False) == {}
    watched.heard.clock.advance(60.0)
    watched.says(system_status=5, custom_mode=6)
    assert watched.found() == {"failsafe": "CRITICAL: a failsafe is active"}


def test_who_must_not_be_commanded_says_so_on_the_ground_too(watched: Watched) -> None:
    watched.vehicle.identity.untrusted = "signs with an unknown key"
    assert watched.found(in_flight=False) == {"identity": "NOT COMMANDED: signs with an unknown key"}
    watched.vehicle.identity.untrusted, watched.vehicle.identity.blocked = "", "several vehicles use id 1"
    assert watched.found() == {"identity": "several vehicles use id 1; this one is flown on"}
