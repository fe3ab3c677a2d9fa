"""What has to be set up before a vehicle may fly: parameters by section, and whether their values are fit for flight.

Rules of each autopilot's own setup: ArduPilot's arming checks and parameter references of 4.7, PX4's parameters.json of
1.17. Failsafes, airframe, radio and gains have tables of their own beside this file; their sections are built there.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from tui_gcs.core.base.float32 import shown, whole_number
from tui_gcs.core.firmware.airframes import airframe
from tui_gcs.core.firmware.calibration_setup import Sensor
from tui_gcs.core.firmware.rc_setup import rc_parameters
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4
from tui_gcs.core.mavlink.mode_names import known_modes

Values = Mapping[str, float]
"""Parameters that the vehicle reported, by name."""


class SetupState(StrEnum):
    """How a part of the setup stands."""

    DONE = "done"
    ATTENTION = "needs attention"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class SetupFinding:
    """How a part of the setup stands, and what it is or lacks, in words."""

    state: SetupState
    text: str


@dataclass(frozen=True)
class SetupParameter:
    """One parameter that an operator sets for a section."""

    name: str
    label: str
    choices: Mapping[int, str] = field(default_factory=dict)
    """Names of its values; empty for a measure."""
    unit: str = ""


_COPTER_BATTERY_MONITORS = {
    0: "none",
    3: "analog voltage",
    4: "analog voltage and current",
    7: "SMBus",
    8: "DroneCAN",
    9: "ESCs",
    10: "sum of other monitors",
    21: "INA2xx",
    29: "script",
}
"""BATT_MONITOR: the usual ones; any other number is taken, too."""
_PX4_SOURCES = {-1: "none", 0: "power module", 1: "external", 2: "ESCs"}
_PX4_CELLS = {0: "not set", **{cells: f"{cells}S" for cells in range(1, 17)}}
_PX4_MODES = {
    -1: "none",
    0: "Manual",
    1: "Altitude",
    2: "Position",
    3: "Mission",
    4: "Hold",
    5: "Return",
    6: "Acro",
    7: "Offboard",
    8: "Stabilized",
    9: "Position Slow",
    10: "Takeoff",
    11: "Land",
    12: "Follow Me",
    13: "Precision Land",
}
"""COM_FLTMODE1 to COM_FLTMODE6."""
MAX_CHANNELS = 16
_CHANNELS = {0: "none", **{channel: f"channel {channel}" for channel in range(1, MAX_CHANNELS + 1)}}
_PX4_INPUTS = {
    0: "RC only",
    1: "joystick over MAVLink only",
    2: "RC, else MAVLink",
    3: "RC or MAVLink, the first one",
    4: "manual control is off",
}
"""COM_RC_IN_MODE: the usual values."""
_WITHOUT_RADIO = (1, 4)
"""COM_RC_IN_MODE: values with which no transmitter is expected."""
_FACTORY_PULSES_US = {"MIN": 1100, "MAX": 1900, "TRIM": 1500}
"""ArduPilot's RCn parameters before any calibration."""
MODE_SLOTS = 6

_BATTERIES = {
    AUTOPILOT_ARDUPILOT: (
        SetupParameter("BATT_MONITOR", "monitor", _COPTER_BATTERY_MONITORS),
        SetupParameter("BATT_CAPACITY", "capacity", unit="mAh"),
        SetupParameter("BATT_LOW_VOLT", "low voltage", unit="V"),
        SetupParameter("BATT_CRT_VOLT", "critical voltage", unit="V"),
        SetupParameter("BATT_ARM_VOLT", "least voltage to arm", unit="V"),
        SetupParameter("BATT_VOLT_MULT", "voltage divider"),
        SetupParameter("BATT_AMP_PERVLT", "current sensor", unit="A/V"),
    ),
    AUTOPILOT_PX4: (
        SetupParameter("BAT1_SOURCE", "source", _PX4_SOURCES),
        SetupParameter("BAT1_N_CELLS", "cells", _PX4_CELLS),
        SetupParameter("BAT1_CAPACITY", "capacity", unit="mAh"),
        SetupParameter("BAT1_V_CHARGED", "full cell", unit="V"),
        SetupParameter("BAT1_V_EMPTY", "empty cell", unit="V"),
        SetupParameter("BAT_LOW_THR", "low", unit="share"),
        SetupParameter("BAT_CRIT_THR", "critical", unit="share"),
        SetupParameter("BAT_EMERGEN_THR", "emergency", unit="share"),
    ),
}
_SENSOR_PARAMETERS = {
    AUTOPILOT_ARDUPILOT: (
        *(f"INS_ACCOFFS_{axis}" for axis in "XYZ"),
        "COMPASS_ENABLE",
        *(f"COMPASS_OFS_{axis}" for axis in "XYZ"),
    ),
    AUTOPILOT_PX4: (
        "CAL_GYRO0_ID",
        "CAL_ACC0_ID",
        "SYS_HAS_MAG",
        "CAL_MAG0_ID",
        "SYS_HAS_NUM_ASPD",
        "SENS_DPRES_OFF",
    ),
}


def battery_parameters(vehicle: Vehicle) -> tuple[SetupParameter, ...]:
    """The parameters of its battery monitor; none for an autopilot that is not known."""
    return _BATTERIES.get(vehicle.autopilot, ())


def mode_parameters(vehicle: Vehicle) -> tuple[SetupParameter, ...]:
    """The parameters that give a transmitter's switch its modes."""
    if vehicle.autopilot == AUTOPILOT_PX4:
        slots = (SetupParameter(f"COM_FLTMODE{n}", f"mode {n}", _PX4_MODES) for n in range(1, MODE_SLOTS + 1))
        return (SetupParameter("RC_MAP_FLTMODE", "switch", _CHANNELS), *slots)
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT:
        modes = known_modes(vehicle.autopilot, vehicle.type)
        slots = (SetupParameter(f"FLTMODE{n}", f"mode {n}", modes) for n in range(1, MODE_SLOTS + 1))
        return (SetupParameter("FLTMODE_CH", "switch", _CHANNELS), *slots)
    return ()


def input_parameters(vehicle: Vehicle) -> tuple[SetupParameter, ...]:
    """The parameters that choose whether the vehicle listens to a transmitter."""
    is_px4 = vehicle.autopilot == AUTOPILOT_PX4
    return (SetupParameter("COM_RC_IN_MODE", "sticks come from", _PX4_INPUTS),) if is_px4 else ()


def sensor_parameters(vehicle: Vehicle) -> tuple[str, ...]:
    """The names of the parameters by which `sensor_finding` decides."""
    return _SENSOR_PARAMETERS.get(vehicle.autopilot, ())


def radio_parameters(vehicle: Vehicle, values: Values) -> tuple[str, ...]:
    """The names of the parameters by which `radio_finding` decides; more once it is known which channel is which."""
    words = rc_parameters(vehicle)
    if words is None:
        return ()
    maps = tuple(words.maps.values())
    if vehicle.autopilot == AUTOPILOT_PX4:
        return ("COM_RC_IN_MODE", *maps)
    channels = {whole_number(values.get(name, n)) for n, name in enumerate(maps, 1)}
    mapped = [n for n in range(1, MAX_CHANNELS + 1) if n in channels]
    return (*maps, *(f"RC{n}_{end}" for n in mapped for end in _FACTORY_PULSES_US))


def airframe_finding(vehicle: Vehicle, values: Values) -> SetupFinding:
    """How the airframe stands: 0 means that none was chosen, on both autopilots."""
    words = airframe(vehicle)
    if words is None:
        return SetupFinding(SetupState.UNKNOWN, "not known for this autopilot")
    first = words.fields[0]
    if any(field.param not in values for field in words.fields):
        return _not_read([field.param for field in words.fields if field.param not in values])
    if values[first.param] == 0:
        return SetupFinding(SetupState.ATTENTION, f"no {first.label} is chosen ({first.param} 0)")
    named = (word_of(values[field.param], field.choices) for field in words.fields)
    return SetupFinding(SetupState.DONE, ", ".join(named))


def sensor_finding(vehicle: Vehicle, sensor: Sensor, values: Values) -> SetupFinding | None:
    """Whether a sensor was calibrated; None where no parameter shows that, or it has no such sensor."""
    if vehicle.autopilot == AUTOPILOT_PX4:
        if sensor is Sensor.AIRSPEED:
            return _offsets(values, ("SENS_DPRES_OFF",)) if values.get("SYS_HAS_NUM_ASPD", 0) > 0 else None
        name = {Sensor.GYRO: "CAL_GYRO0_ID", Sensor.ACCEL: "CAL_ACC0_ID", Sensor.COMPASS: "CAL_MAG0_ID"}.get(sensor)
        is_absent = sensor is Sensor.COMPASS and values.get("SYS_HAS_MAG") == 0
        # PX4 notes the device that a calibration is for: 0 is none.
        return _offsets(values, (name,)) if name is not None and not is_absent else None
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT:
        if sensor is Sensor.ACCEL:
            return _offsets(values, tuple(f"INS_ACCOFFS_{axis}" for axis in "XYZ"))
        if sensor is Sensor.COMPASS and values.get("COMPASS_ENABLE") != 0:
            return _offsets(values, tuple(f"COMPASS_OFS_{axis}" for axis in "XYZ"))
    return None


def radio_finding(vehicle: Vehicle, values: Values) -> SetupFinding:
    """Whether the pilot's transmitter was calibrated, or none is expected."""
    names = radio_parameters(vehicle, values)
    if not names:
        return SetupFinding(SetupState.UNKNOWN, "not known for this autopilot")
    mode = values.get("COM_RC_IN_MODE") if vehicle.autopilot == AUTOPILOT_PX4 else None
    if mode is not None and mode in _WITHOUT_RADIO:
        text = f"no transmitter is expected: {_PX4_INPUTS[int(mode)]} (COM_RC_IN_MODE {mode:g})"
        return SetupFinding(SetupState.DONE, text)
    missing = [name for name in names if name not in values]
    if missing:
        return _not_read(missing)
    words = rc_parameters(vehicle)
    sticks = words.maps if words is not None else {}
    unmapped = [str(stick) for stick, name in sticks.items() if values[name] == 0]
    if unmapped:
        return SetupFinding(SetupState.ATTENTION, f"no channel is {', '.join(unmapped)}: calibrate the transmitter")
    pulses = [(name, us) for end, us in _FACTORY_PULSES_US.items() for name in names if name.endswith(f"_{end}")]
    if pulses and all(values[name] == us for name, us in pulses):
        return SetupFinding(SetupState.ATTENTION, "never calibrated: all ends of its channels are the factory's")
    channels = ", ".join(f"{stick} {values[name]:g}" for stick, name in sticks.items())
    return SetupFinding(SetupState.DONE, f"channels: {channels}")


def mode_finding(vehicle: Vehicle, values: Values) -> SetupFinding:
    """Whether a pilot can choose modes by a switch."""
    fields = mode_parameters(vehicle)
    if not fields:
        return SetupFinding(SetupState.UNKNOWN, "not known for this autopilot")
    missing = [field.name for field in fields if field.name not in values]
    if missing:
        return _not_read(missing)
    switch, *slots = fields
    named = list(dict.fromkeys(word_of(values[slot.name], slot.choices) for slot in slots))
    if values[switch.name] == 0:
        if values.get("COM_RC_IN_MODE") in _WITHOUT_RADIO:
            return SetupFinding(SetupState.DONE, "no transmitter is expected, so no switch")
        return SetupFinding(SetupState.ATTENTION, f"no switch chooses modes ({switch.name} 0)")
    return SetupFinding(SetupState.DONE, f"channel {values[switch.name]:g}: {', '.join(named)}")


def battery_finding(vehicle: Vehicle, values: Values) -> SetupFinding:
    """Whether the battery is measured, and its size is known."""
    fields = battery_parameters(vehicle)
    if not fields:
        return SetupFinding(SetupState.UNKNOWN, "not known for this autopilot")
    monitor, size, *_ = fields
    if monitor.name not in values or size.name not in values:
        return _not_read([field.name for field in (monitor, size) if field.name not in values])
    if word_of(values[monitor.name], monitor.choices) == "none":
        text = f"no battery is measured ({monitor.name} {values[monitor.name]:g})"
        return SetupFinding(SetupState.ATTENTION, text)
    if not values[size.name] > 0:  # NaN is not
        why = "what is left is guessed" if size.choices else "what is left is not known"
        return SetupFinding(SetupState.ATTENTION, f"{size.label}: not set ({size.name}), so {why}")
    shown = word_of(values[size.name], size.choices) if size.choices else f"{values[size.name]:g} {size.unit}"
    return SetupFinding(SetupState.DONE, f"{word_of(values[monitor.name], monitor.choices)}, {shown}")


def word_of(value: float, choices: Mapping[int, str]) -> str:
    """Return the name of a value, or the value itself where it has none."""
    number = whole_number(value)
    return (choices.get(number) if number is not None else None) or shown(value)


def _offsets(values: Values, names: tuple[str, ...]) -> SetupFinding:
    """Whether a calibration has written these: all 0 is the factory's."""
    missing = [name for name in names if name not in values]
    if missing:
        return _not_read(missing)
    if all(values[name] == 0 for name in names):
        return SetupFinding(SetupState.ATTENTION, "NOT calibrated")
    return SetupFinding(SetupState.DONE, "calibrated")


def _not_read(names: Iterable[str]) -> SetupFinding:
    first, *more = names
    return SetupFinding(SetupState.UNKNOWN, f"{first} was not read" + (f", nor {len(more)} more" if more else ""))
