"""Texts, modes, arming and errors of logs that vehicles wrote themselves."""

from pathlib import Path

import pytest

from tests.core.records.onboard_log_files import GPS, copter_log, dataflash, px4_log, ulog
from tui_gcs.core.records.event_log import CRITICAL, ERROR, INFO, NOTICE
from tui_gcs.core.records.onboard_events import onboard_events
from tui_gcs.core.records.onboard_logs import EARLIEST_WALL_S, OnboardLogError


def written(tmp_path: Path, name: str, data: bytes) -> Path:
    path = tmp_path / name
    path.write_bytes(data)
    return path


def said(path: Path) -> list[tuple[int, str]]:
    return [(event.severity, event.text) for event in onboard_events(path)]


def test_a_copters_log_says_what_it_did(tmp_path: Path) -> None:
    path = written(tmp_path, "a.bin", copter_log())
    assert said(path) == [(INFO, "ArduCopter V4.6.0"), (NOTICE, "mode LOITER"), (NOTICE, "armed")]
    assert {event.vehicle for event in onboard_events(path)} == {7}
    assert all(event.wall_s > EARLIEST_WALL_S for event in onboard_events(path))


def test_errors_are_named_and_so_is_their_end(tmp_path: Path) -> None:
    rows = [
        (150, "ERR", "QBB", "TimeUS,Subsys,ECode", (1_000_000, 6, 1)),
        (150, "ERR", "QBB", "TimeUS,Subsys,ECode", (2_000_000, 6, 0)),
        (150, "ERR", "QBB", "TimeUS,Subsys,ECode", (3_000_000, 99, 2)),
        (151, "ARM", "QBI", "TimeUS,ArmState,ArmChecks", (4_000_000, 0, 0)),
        (143, "EV", "QB", "TimeUS,Id", (5_000_000, 250)),
    ]
    assert said(written(tmp_path, "a.bin", dataflash(rows))) == [
        (ERROR, "ERROR: battery failsafe, code 1"),
        (NOTICE, "over: battery failsafe"),
        (ERROR, "ERROR: subsystem 99, code 2"),
        (NOTICE, "disarmed"),
        (NOTICE, "event 250"),
    ]


def test_without_gps_time_it_counts_from_boot(tmp_path: Path) -> None:
    rows = [(143, "EV", "QB", "TimeUS,Id", (5_000_000, 10))]
    (event,) = onboard_events(written(tmp_path, "a.bin", dataflash(rows)))
    assert event.wall_s == pytest.approx(5.0)


def test_a_px4_log_says_what_it_did(tmp_path: Path) -> None:
    events = onboard_events(written(tmp_path, "a.ulg", px4_log()))
    assert [(event.severity, event.text) for event in events] == [(NOTICE, "mode HOLD"), (NOTICE, "armed")]
    assert events[0].vehicle == 3
    assert events[0].wall_s == pytest.approx(1_700_000_000 - 1.0, abs=0.01)


def test_a_px4_failsafe_is_critical_and_ends(tmp_path: Path) -> None:
    fields = "uint64_t timestamp;uint8_t nav_state;uint8_t arming_state;uint8_t failsafe"
    rows: list[tuple[object, ...]] = [(1, 4, 2, 0), (2, 4, 2, 0), (3, 5, 2, 1), (4, 5, 1, 0)]
    texts = said(written(tmp_path, "a.ulg", ulog({"vehicle_status": (fields, rows)})))
    assert (CRITICAL, "FAILSAFE") in texts
    assert [text for _, text in texts].count("no failsafe") == 2
    assert (NOTICE, "disarmed") in texts


def test_hostile_text_is_cleaned(tmp_path: Path) -> None:
    rows = [(140, "MSG", "QZ", "TimeUS,Message", (1000, "\x1b]0;own\x07[red]"))]
    ((_, text),) = said(written(tmp_path, "a.bin", dataflash(rows)))
    assert "\x1b" not in text and "\x07" not in text


@pytest.mark.parametrize("name", ["a.bin", "a.ulg"])
def test_what_is_no_log_says_so(tmp_path: Path, name: str) -> None:
    with pytest.raises(OnboardLogError):
        onboard_events(tmp_path / name)
    with pytest.raises(OnboardLogError, match="not a log"):
        onboard_events(written(tmp_path, name, b"text"))


def test_a_torn_log_gives_what_it_has_or_says_that_it_is_damaged(tmp_path: Path) -> None:
    whole = dataflash([(*GPS, (1, 0, 3, 0, 1900, 1, 1, 1.0, 0.0, 0.0, 0.0)), (143, "EV", "QB", "TimeUS,Id", (5, 10))])
    for kept in range(100, len(whole), 7):
        path = written(tmp_path, "a.bin", whole[:kept])
        try:
            assert len(onboard_events(path)) <= 1
        except OnboardLogError as error:
            assert "damaged" in str(error)
