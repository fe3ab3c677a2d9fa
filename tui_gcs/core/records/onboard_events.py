"""What happened by the logs that vehicles wrote themselves: texts, modes, arming, errors and failsafes over time."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from tui_gcs.core.base.text import clean
from tui_gcs.core.mavlink.mode_names import ardupilot_mode_name, px4_nav_state_name
from tui_gcs.core.records.event_log import CRITICAL, ERROR, INFO, NOTICE, WARNING
from tui_gcs.core.records.onboard_logs import (
    DAMAGED,
    EARLIEST_WALL_S,
    PX4_ARMED,
    OnboardLogError,
    dataflash_errors,
    first_instances,
    open_dataflash,
    open_ulog,
    system_id,
    time_offset_s,
    wordless,
)

MAX_EVENTS = 20_000
"""Events of one log; a log with more of them is damaged or floods."""
MAX_CELLS = 200
MIN_FORMATS = 2
"""That of FMT itself, which the reader brings, and one more."""
_READ = ["MODE", "MSG", "EV", "ERR", "ARM"]
_NAMED_EVENTS = {
    **{10: "armed", 11: "disarmed", 15: "auto armed", 17: "land complete maybe", 18: "land complete"},
    **{19: "lost GPS", 21: "flip started", 22: "flip ended", 25: "home set", 28: "not landed"},
    **{41: "fence enabled", 42: "fence disabled", 49: "parachute disabled", 50: "parachute enabled"},
    **{51: "parachute released", 54: "motors stopped by the emergency switch", 56: "motor interlock off"},
    **{57: "motor interlock on", 60: "EKF altitude reset", 61: "landing cancelled by the pilot"},
    **{62: "EKF yaw reset", 67: "standby", 68: "standby over", 71: "fence breached", 163: "surfaced"},
}
"""LogEvent of AP_Logger (AP_Logger.h)."""
_SUBSYSTEMS = {
    **{1: "main", 2: "radio", 3: "compass", 4: "optical flow", 5: "radio failsafe", 6: "battery failsafe"},
    **{7: "GPS failsafe", 8: "GCS failsafe", 9: "fence", 10: "flight mode refused", 11: "GPS", 12: "crash check"},
    **{13: "flip", 14: "autotune", 15: "parachute", 16: "EKF check", 17: "EKF failsafe", 18: "barometer"},
    **{19: "CPU overload", 20: "ADS-B failsafe", 21: "terrain", 22: "navigation", 23: "terrain failsafe"},
    **{24: "primary EKF changed", 25: "thrust loss", 26: "sensor failsafe", 27: "leak failsafe"},
    **{28: "pilot input", 29: "vibration failsafe", 30: "internal error", 31: "dead reckoning failsafe"},
}
"""LogErrorSubsystem of AP_Logger; error code 0 means that it is over."""


class OnboardEvent(NamedTuple):
    """One thing that a vehicle logged."""

    wall_s: float
    """Unix seconds; seconds since boot in a log without GPS time."""
    vehicle: int
    severity: int
    """MAV_SEVERITY."""
    text: str


def onboard_events(path: Path) -> tuple[OnboardEvent, ...]:
    """Return the events in a .bin or .ulg, by time.

    Raises:
        OnboardLogError: unreadable, damaged, or pyulog is not installed.
    """
    found = list(_ulog_events(path) if path.suffix.lower() == ".ulg" else _dataflash_events(path))
    return tuple(sorted(found, key=lambda event: event.wall_s))


def _dataflash_events(path: Path) -> Iterator[OnboardEvent]:
    log = open_dataflash(path)
    if len(log.formats) < MIN_FORMATS:
        raise OnboardLogError("not a log of ArduPilot, or damaged: no format of a message in it")
    count = 0
    while count < MAX_EVENTS:
        with dataflash_errors(), wordless():
            message = log.recv_match(type=_READ)
        if message is None:
            return
        said = _dataflash_words(log, message)
        if said is not None:
            count += 1
            severity, text = said
            yield OnboardEvent(_time_s(message), system_id(log.params), severity, clean(text, MAX_CELLS))


def _time_s(message: Any) -> float:
    """Return the time of a message: absolute if the log has GPS time, else since boot."""
    wall_s = float(message._timestamp)
    if wall_s >= EARLIEST_WALL_S:
        return wall_s
    # Without GPS time the reader leaves old messages at 0; TimeMS is what logs before 2015 have.
    if hasattr(message, "TimeUS"):
        return float(message.TimeUS) / 1e6
    return float(message.TimeMS) / 1e3 if hasattr(message, "TimeMS") else wall_s


def _dataflash_words(log: Any, message: Any) -> tuple[int, str] | None:
    """Return severity and text of a message; None for one without meaning here."""
    kind = message.get_type()
    with contextlib.suppress(AttributeError, *DAMAGED):
        if kind == "MSG":
            return INFO, str(message.Message)
        if kind == "MODE":
            number = getattr(message, "ModeNum", message.Mode)
            if not isinstance(number, int | float):
                return NOTICE, f"mode {number}"
            return NOTICE, f"mode {ardupilot_mode_name(log.mav_type, int(number))}"
        if kind == "ARM":
            return NOTICE, "armed" if message.ArmState else "disarmed"
        if kind == "EV":
            return NOTICE, _NAMED_EVENTS.get(int(message.Id), f"event {int(message.Id)}")
        if kind == "ERR":
            subsystem = _SUBSYSTEMS.get(int(message.Subsys), f"subsystem {int(message.Subsys)}")
            code = int(message.ECode)
            return (NOTICE, f"over: {subsystem}") if code == 0 else (ERROR, f"ERROR: {subsystem}, code {code}")
    return None


def _ulog_events(path: Path) -> Iterator[OnboardEvent]:
    log = open_ulog(path)
    try:
        topics = first_instances(log)
        vehicle, offset_s = int(log.initial_parameters.get("MAV_SYS_ID", 1)), time_offset_s(topics)
        for message in log.logged_messages[:MAX_EVENTS]:
            # log_level is the character '0' to '7' of Linux's printk, the same scale as MAV_SEVERITY.
            severity = min(7, max(0, int(message.log_level) - ord("0")))
            text = clean(message.message.rstrip("\t"), MAX_CELLS)
            yield OnboardEvent(message.timestamp / 1e6 + offset_s, vehicle, severity, text)
        status = topics.get("vehicle_status")
        for time_us, severity, change in _status_changes(status) if status is not None else ():
            yield OnboardEvent(time_us / 1e6 + offset_s, vehicle, severity, change)
        for dropout in log.dropouts[:MAX_EVENTS]:
            missing = f"{dropout.duration} ms are missing from the log"
            yield OnboardEvent(dropout.timestamp / 1e6 + offset_s, vehicle, WARNING, missing)
    except DAMAGED as error:
        raise OnboardLogError(f"damaged ({type(error).__name__})") from None


def _status_changes(status: dict[str, Any]) -> Iterator[tuple[int, int, str]]:
    """Yield time in microseconds, severity and words of each change of mode, arming and failsafe."""
    for time_us, mode in _changes(status, "nav_state", int):
        yield time_us, NOTICE, f"mode {px4_nav_state_name(mode)}"
    for time_us, armed in _changes(status, "arming_state", lambda value: value == PX4_ARMED):
        yield time_us, NOTICE, "armed" if armed else "disarmed"
    for time_us, failsafe in _changes(status, "failsafe", bool):
        yield (time_us, CRITICAL, "FAILSAFE") if failsafe else (time_us, NOTICE, "no failsafe")


def _changes(status: dict[str, Any], name: str, meaning: Callable[[int], int]) -> Iterator[tuple[int, int]]:
    """Yield time and meaning of a column where its meaning changes, also of the first row."""
    if name not in status:
        return
    before: int | None = None
    for time_us, value in zip(status["timestamp"].tolist(), status[name].tolist(), strict=True):
        if (now := meaning(value)) != before:
            before = now
            yield time_us, now
