"""What a vehicle does by itself when a link, its battery, its position or its set-points are lost, in words.

Which parameters decide that differs by firmware; their values are from the autopilots' own parameter references (PX4:
parameters.json of 1.17; ArduPilot: ArduCopter/Parameters.cpp, AP_BattMonitor_Params.cpp, AC_Fence.cpp of 4.7). What
happens then was measured (docs/autopilots.md). Both ship with the failsafe for a lost ground station switched off.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from tui_gcs.core.base.float32 import whole_number
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4
from tui_gcs.core.mavlink.mode_names import known_modes

Values = Mapping[str, float]
"""Parameters that the vehicle reported, by name."""


@dataclass(frozen=True)
class FailsafeLine:
    """One thing that may go wrong, and what the vehicle does then."""

    when: str
    does: str
    warning: bool
    """It does nothing, or something dangerous, or that is not known: an operator must accept it."""
    param: str = ""
    """The parameter that chooses what it does; "" if none does."""
    choices: Mapping[int, str] = field(default_factory=dict)
    """What it would do by the values of that parameter."""

    @property
    def check(self) -> str:
        """The check before a start that shows it (`protocol.preflight`)."""
        return next((check for begin, check in _CHECKS if self.when.startswith(begin)), "station-loss")


_CHECKS = (
    ("battery", "battery-loss"),
    ("fence", "fence-cross"),
    ("position", "position-loss"),
    ("set-points", "setpoint-loss"),
    ("pilot's RC", "stick-loss"),
    ("sticks", "stick-loss"),
)
"""How `when` begins, and the check it belongs to; the rest is about this station's link."""
UNHEARD = ("this station is not heard", "no station is heard")
"""`FailsafeLine.when` of a lost station, for an ArduCopter and for a PX4."""

_COPTER = (
    "FS_GCS_ENABLE",
    "FS_GCS_TIMEOUT",
    "FS_OPTIONS",
    "RTL_ALT",
    "RTL_ALT_M",
    "MAV_GCS_SYSID",
    "SYSID_MYGCS",
    "BATT_FS_LOW_ACT",
    "BATT_FS_CRT_ACT",
    "BATT_LOW_VOLT",
    "BATT_LOW_MAH",
    "BATT_CRT_VOLT",
    "BATT_CRT_MAH",
    "FENCE_ENABLE",
    "FENCE_ACTION",
    "FS_EKF_ACTION",
    "FS_THR_ENABLE",
    "GUID_TIMEOUT",
)
_PX4 = (
    "NAV_DLL_ACT",
    "COM_DL_LOSS_T",
    "COM_DLL_EXCEPT",
    "COM_FAIL_ACT_T",
    "COM_OBL_RC_ACT",
    "COM_OF_LOSS_T",
    "RTL_RETURN_ALT",
    "COM_LOW_BAT_ACT",
    "BAT_CRIT_THR",
    "BAT_EMERGEN_THR",
    "GF_ACTION",
    "NAV_RCL_ACT",
    "COM_RC_IN_MODE",
)
_SMART = "returns by its own track (SmartRTL)"
_RETURNS, _LANDS = "returns (RTL)", "lands where it is"
_SMART_OR_RTL, _SMART_OR_LANDS = f"{_SMART} or RTL", f"{_SMART} or lands"
# Words for the values of action parameters, as the parameters' own metadata list them.
_LAST_ACTIONS = {6: "flies its landing sequence, or RTL", 7: "brakes, or lands"}
_GCS_ACTIONS = {1: _RETURNS, 2: _RETURNS, 3: _SMART_OR_RTL, 4: _SMART_OR_LANDS, 5: _LANDS} | _LAST_ACTIONS
_THR_ACTIONS = {1: _RETURNS, 2: _RETURNS, 3: _LANDS, 4: _SMART_OR_RTL, 5: _SMART_OR_LANDS} | _LAST_ACTIONS
_BATTERY_ACTIONS = _LAST_ACTIONS | {
    1: _LANDS,
    2: _RETURNS,
    3: _SMART_OR_RTL,
    4: _SMART_OR_LANDS,
    5: "TERMINATES the flight",
}
_FENCE_ACTIONS = {
    1: "returns (RTL) or lands",
    2: "lands where it is",
    3: f"{_SMART}, RTL or lands",
    4: "brakes, or lands",
    5: f"{_SMART} or lands",
}
_EKF_ACTIONS = {1: "lands after 8 s", 2: "changes to ALT_HOLD, which reads the throttle stick", 3: "lands after 8 s"}
_CONTINUE_AUTO = 2
"""FS_OPTIONS: bit 1 goes on in AUTO without a ground station."""

_DLL_ACTIONS = {
    1: "holds",
    2: "returns (RTL)",
    3: "lands where it is",
    5: "TERMINATES the flight",
    6: "DISARMS in the air",
}
# Flown with PX4 1.16.1: in Position mode without a pilot's sticks it sank at 0.6 to 0.9 m/s, past vehicles on lower
# layers (docs/autopilots.md E). 1.17 alpha returned instead; the worse of the two is shown.
_OBL_ACTIONS = {
    0: "Position mode, without a pilot SINKS through the layers below",
    1: "Altitude mode, without a pilot SINKS through the layers below",
    2: "Stabilized mode, without a pilot FALLS",
    3: "returns (RTL), at a height of its own",
    4: "lands where it is",
    5: "holds",
    6: "TERMINATES the flight",
    7: "DISARMS in the air",
}
_GF_ACTIONS = {2: "holds", 3: "returns (RTL)", 4: "TERMINATES the flight", 5: "lands where it is"}
_OFFBOARD_EXCEPTED = 4
"""COM_DLL_EXCEPT, bit 2."""


def wanted(vehicle: Vehicle) -> tuple[str, ...]:
    """The parameters that decide it. Old and new names of one are both there; a vehicle has one of them."""
    if vehicle.autopilot == AUTOPILOT_PX4:
        return _PX4
    return _COPTER if _is_copter(vehicle) else ()


def explain(vehicle: Vehicle, values: Values, own_system: int) -> tuple[FailsafeLine, ...]:
    """What the vehicle does, by cause. A value that was not read is a warning."""
    if vehicle.autopilot == AUTOPILOT_PX4:
        return tuple(_px4(values))
    if _is_copter(vehicle):
        return tuple(_copter(values, own_system))
    return (FailsafeLine("anything is lost", "not known for this kind of vehicle", warning=True),)


def _is_copter(vehicle: Vehicle) -> bool:
    return vehicle.autopilot == AUTOPILOT_ARDUPILOT and "BRAKE" in known_modes(vehicle.autopilot, vehicle.type).values()


def _action_line(values: Values, when: str, name: str, words: Mapping[int, str], delay: str = "") -> FailsafeLine:
    """One action parameter in words; 0 and values that are not in `words` are warnings."""
    value, choices = values.get(name), {0: "NOTHING", **words}
    if value is None:
        return FailsafeLine(when, f"not known: {name} was not read", True, name, choices)
    number = whole_number(value)
    word = words.get(number) if number is not None else None
    if word is None:
        nothing = "NOTHING" if value == 0 else f"not known: {name} is {value:g}"
        return FailsafeLine(when, f"{nothing} ({name} 0)" if value == 0 else nothing, True, name, choices)
    dangerous = word.split()[0].isupper()
    return FailsafeLine(when, f"{word}{delay} ({name} {value:g})", dangerous, name, choices)


def _seconds(values: Values, name: str) -> str:
    return f" after {values[name]:g} s" if name in values else ""


def _copter(values: Values, own_system: int) -> Iterator[FailsafeLine]:
    yield from _copter_station(values, own_system)
    for level, action in (("low", "BATT_FS_LOW_ACT"), ("critical", "BATT_FS_CRT_ACT")):
        yield _copter_battery(values, level, action)
    yield _copter_fence(values)
    yield _action_line(values, "position estimate lost (GPS, EKF)", "FS_EKF_ACTION", _EKF_ACTIONS)
    yield _action_line(values, "pilot's RC lost", "FS_THR_ENABLE", _THR_ACTIONS)
    brakes = f"brakes {values['GUID_TIMEOUT']:g} s after the last moving one" if "GUID_TIMEOUT" in values else "brakes"
    yield FailsafeLine("set-points cease (GUIDED)", f"{brakes}; flies to the last fixed place and stays", warning=False)


def _copter_station(values: Values, own_system: int) -> Iterator[FailsafeLine]:
    line = _action_line(values, UNHEARD[0], "FS_GCS_ENABLE", _GCS_ACTIONS, _seconds(values, "FS_GCS_TIMEOUT"))
    yield line
    if (whole_number(values.get("FS_OPTIONS")) or 0) & _CONTINUE_AUTO:
        yield FailsafeLine("this station is not heard in AUTO", "goes on with its mission (FS_OPTIONS)", warning=False)
    # ArduPilot's failsafe counts the heartbeats of one system id only (docs/autopilots.md C1); its name changed in 4.7.
    name = "MAV_GCS_SYSID" if "MAV_GCS_SYSID" in values else "SYSID_MYGCS"
    station = values.get(name)
    if station is None:
        yield FailsafeLine("which station it listens for", "not known: MAV_GCS_SYSID was not read", warning=True)
    elif station != own_system:
        text = f"waits for the heartbeat of station {station:g}, not ours ({own_system}): {name}"
        yield FailsafeLine("which station it listens for", text, True, name, {own_system: "this station"})


def _copter_battery(values: Values, level: str, action: str) -> FailsafeLine:
    line = _action_line(values, f"battery {level}", action, _BATTERY_ACTIONS)
    prefix = "BATT_LOW" if level == "low" else "BATT_CRT"
    volts, mah = values.get(f"{prefix}_VOLT"), values.get(f"{prefix}_MAH")
    # An action without any limit never trips.
    if not line.warning and volts == 0 and mah == 0:
        return replace(line, does=f"NOTHING: no limit is set ({prefix}_VOLT, {prefix}_MAH)", warning=True)
    return line


def _copter_fence(values: Values) -> FailsafeLine:
    line = _action_line(values, "fence crossed", "FENCE_ACTION", _FENCE_ACTIONS)
    # DO_FENCE_ENABLE switches a fence on and leaves this parameter as it is (measured).
    enabled = values.get("FENCE_ENABLE")
    if enabled == 0:
        text = "NOTHING by parameter (FENCE_ENABLE 0); a fence may be on by command: see the GEOFENCE sensor"
        return FailsafeLine(line.when, text, True, "FENCE_ENABLE", {0: "NOTHING by parameter", 1: "the fence is on"})
    if enabled is None:
        return replace(line, does="not known: FENCE_ENABLE was not read", warning=True)
    return line


def _px4(values: Values) -> Iterator[FailsafeLine]:
    # Measured with 10 s and 5 s: it returned 17.7 s after the last heartbeat, for it notices the loss 2.5 s late.
    hold = f" and {values['COM_FAIL_ACT_T']:g} s of holding" if values.get("COM_FAIL_ACT_T", 0) > 0 else ""
    delay = _seconds(values, "COM_DL_LOSS_T") + (hold if "COM_DL_LOSS_T" in values else "")
    yield _action_line(values, UNHEARD[1], "NAV_DLL_ACT", _DLL_ACTIONS, delay)
    if (whole_number(values.get("COM_DLL_EXCEPT")) or 0) & _OFFBOARD_EXCEPTED:
        yield FailsafeLine("no station is heard in OFFBOARD", "NOTHING (COM_DLL_EXCEPT)", warning=True)
    offboard = _seconds(values, "COM_OF_LOSS_T")
    line = _action_line(values, "set-points cease (OFFBOARD)", "COM_OBL_RC_ACT", _OBL_ACTIONS, offboard)
    comes_down = values.get("COM_OBL_RC_ACT") in (0, 1, 2, 4)
    yield replace(line, warning=line.warning or comes_down)
    yield _px4_battery(values)
    yield _action_line(values, "fence crossed", "GF_ACTION", _GF_ACTIONS)
    yield FailsafeLine("position estimate lost (GPS)", "descends where it is after 5 s (measured)", warning=False)
    without = "" if values.get("COM_RC_IN_MODE") == 4 else "; ignored if there was none at arming"
    line = _action_line(values, "sticks (RC or joystick) lost", "NAV_RCL_ACT", _DLL_ACTIONS)
    yield replace(line, does=line.does + without)


def _px4_battery(values: Values) -> FailsafeLine:
    critical, last = (
        f" at {values[name] * 100:.0f} %" if name in values else "" for name in ("BAT_CRIT_THR", "BAT_EMERGEN_THR")
    )
    words = {2: f"lands where it is{critical}", 3: f"returns (RTL){critical}, lands{last}"}
    return _action_line(values, "battery critical", "COM_LOW_BAT_ACT", words)
