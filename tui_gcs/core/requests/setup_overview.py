"""How the setup of vehicles stands: a row for each section, judged by what was read from each vehicle.

`SetupOverview` makes the rows from the tables of `core/firmware` and begins to read what they need. Nothing is read
unasked, and nothing is changed here (`setup_requests`).
"""

from collections.abc import Iterable, Sequence
from functools import partial
from typing import get_args

from tui_gcs.core.base.float32 import whole_number
from tui_gcs.core.firmware.airframes import airframe
from tui_gcs.core.firmware.calibration_setup import Sensor, calibration, motor_word, motors
from tui_gcs.core.firmware.failsafes import UNHEARD
from tui_gcs.core.firmware.registry import name_of
from tui_gcs.core.firmware.setup_sections import (
    SetupFinding,
    SetupParameter,
    SetupState,
    Values,
    airframe_finding,
    battery_finding,
    battery_parameters,
    input_parameters,
    mode_finding,
    mode_parameters,
    radio_finding,
    radio_parameters,
    sensor_finding,
    sensor_parameters,
)
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.setup import (
    ReadSetup,
    SectionWord,
    SensorWord,
    SetupFieldRow,
    SetupSectionRow,
)
from tui_gcs.core.requests.handler import VehicleAct
from tui_gcs.core.requests.tasks import Task
from tui_gcs.core.services.all_services import Services
from tui_gcs.core.services.parameters.param_exchange import ParamReading

SECTIONS: tuple[SectionWord, ...] = get_args(SectionWord)
SENSORS: dict[SensorWord, Sensor] = {
    "gyro": Sensor.GYRO,
    "accel": Sensor.ACCEL,
    "simple-accel": Sensor.SIMPLE_ACCEL,
    "level": Sensor.LEVEL,
    "compass": Sensor.COMPASS,
    "baro": Sensor.BARO,
    "airspeed": Sensor.AIRSPEED,
}
RADIO_FIRST = "take the propellers off; the vehicle's receiver must be on"
NOT_KNOWN = SetupFinding(SetupState.UNKNOWN, "not known for this autopilot")
Section = tuple[SetupFinding, list[SetupFieldRow]]


class SetupOverview:
    """Reports how the setup of vehicles stands, and reads what that needs."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self.acts: dict[type, VehicleAct] = {
            ReadSetup: VehicleAct(self._read, lambda r: f"read setup {r.section or ''}".strip())
        }
        self._sections = {
            "airframe": self._airframe,
            "sensors": self._sensors,
            "radio": self._radio,
            "modes": self._modes,
            "failsafes": self._failsafes,
            "motors": self._motors,
            "battery": self._battery,
            "tuning": self._tuning,
        }

    def rows(
        self, vehicles: Iterable[Vehicle], wanted: SectionWord | None, *, only: bool = False
    ) -> tuple[SetupSectionRow, ...]:
        """Return a row for each section of these vehicles, or `only` for `wanted`, which has its lines."""
        sections = (wanted,) if only and wanted is not None else SECTIONS
        rows: list[SetupSectionRow] = []
        for vehicle in vehicles:
            for section in sections:
                finding, fields = self._sections[section](vehicle)
                lines = tuple(fields) if section == wanted else ()
                rows.append(SetupSectionRow(vehicle.id, section, finding.state.value, finding.text, lines))
        return tuple(rows)

    # ---------------------------------------------------------------- reading

    def _read(self, vehicle: Vehicle, request: ReadSetup, task: Task) -> str:
        sections = SECTIONS if request.section is None else (request.section,)
        names = [name for section in sections for name in self._names(vehicle, section)]
        groups = [group.name for group in self._services.tuning.groups(vehicle.id)] if "tuning" in sections else []
        is_open = {"names": bool(names), "failsafes": "failsafes" in sections, **dict.fromkeys(groups, True)}
        if not any(is_open.values()):
            return "nothing of it is kept in parameters"
        missing: list[str] = []

        def done(part: str, reading: ParamReading | None = None) -> None:
            is_open[part] = False
            missing.extend(reading.missing if reading is not None else ())
            if not any(is_open.values()):
                text = f"it has no {', '.join(missing[:3])}{' …' if len(missing) > 3 else ''}" if missing else ""
                task.end(text=text)

        for group in groups:
            # Names of gains that it lacks are those of other versions: no news.
            self._services.tuning.read(vehicle.id, group, lambda _, group=group: done(group))  # type: ignore[misc]
        if names:
            self._services.params.read(vehicle.id, names, partial(done, "names"))
        if is_open["failsafes"]:
            self._services.failsafes.ask(vehicle.id, partial(done, "failsafes"))
        return ""

    def _names(self, vehicle: Vehicle, section: SectionWord) -> tuple[str, ...]:
        words = airframe(vehicle)
        found: dict[SectionWord, tuple[str, ...]] = {
            "airframe": tuple(field.param for field in words.fields) if words is not None else (),
            "sensors": sensor_parameters(vehicle),
            "radio": radio_parameters(vehicle, self._values(vehicle, radio_parameters(vehicle, {}))),
            "modes": _names_of((*mode_parameters(vehicle), *input_parameters(vehicle))),
            "battery": _names_of(battery_parameters(vehicle)),
        }
        return found.get(section, ())

    def _values(self, vehicle: Vehicle, names: Sequence[str]) -> Values:
        """The reported values of these parameters; a vehicle's whole table is not copied for a few."""
        known = self._services.params.table(vehicle.id).params
        return {name: float(known[name].value) for name in names if name in known}

    # ---------------------------------------------------------------- sections

    def _airframe(self, vehicle: Vehicle) -> Section:
        words = airframe(vehicle)
        if words is None:
            return NOT_KNOWN, []
        values = self._values(vehicle, [field.param for field in words.fields])
        fields = [
            SetupFieldRow(
                field.label,
                "airframe",
                field.param,
                whole_number(values.get(field.param)),
                choices=tuple(field.choices.items()),
                prompt=f"a change {words.warning}" if words.warning else "",
            )
            for field in words.fields
        ]
        return airframe_finding(vehicle, values), fields

    def _sensors(self, vehicle: Vehicle) -> Section:
        values = self._values(vehicle, sensor_parameters(vehicle))
        fields: list[SetupFieldRow] = []
        found: list[tuple[str, SetupFinding]] = []
        for word, sensor in SENSORS.items():
            procedure = calibration(vehicle, sensor)
            if procedure is None:
                continue
            finding = sensor_finding(vehicle, sensor, values)
            found += [(word, finding)] if finding is not None else []
            prompt = procedure.prompt + (f" ({procedure.no_cancel})" if procedure.no_cancel else "")
            text = finding.text if finding is not None else "no record is kept"
            attention = finding is not None and finding.state is SetupState.ATTENTION
            fields.append(SetupFieldRow(word, "calibrate", words=text, needs_attention=attention, prompt=prompt))
        if vehicle.set_up or vehicle.reboot_first:
            return SetupFinding(SetupState.ATTENTION, vehicle.why_not_started), fields
        return _together(found), fields

    def _radio(self, vehicle: Vehicle) -> Section:
        values = self._values(vehicle, radio_parameters(vehicle, {}))
        values = self._values(vehicle, radio_parameters(vehicle, values))
        finding = radio_finding(vehicle, values)
        attention = finding.state is SetupState.ATTENTION
        if not values and finding.text == NOT_KNOWN.text:
            return NOT_KNOWN, []
        row = SetupFieldRow("rc", "calibrate", words=finding.text, needs_attention=attention, prompt=RADIO_FIRST)
        return finding, [row, *self._parameters(vehicle, input_parameters(vehicle))]

    def _modes(self, vehicle: Vehicle) -> Section:
        parameters = mode_parameters(vehicle)
        names = _names_of((*parameters, *input_parameters(vehicle)))
        return mode_finding(vehicle, self._values(vehicle, names)), self._parameters(vehicle, parameters)

    def _battery(self, vehicle: Vehicle) -> Section:
        parameters = battery_parameters(vehicle)
        finding = battery_finding(vehicle, self._values(vehicle, _names_of(parameters)))
        return finding, self._parameters(vehicle, parameters)

    def _failsafes(self, vehicle: Vehicle) -> Section:
        lines = self._services.failsafes.report(vehicle)
        names = [line.param for line in lines if line.param]
        values = self._values(vehicle, names)
        fields = [
            SetupFieldRow(
                line.when,
                "parameter" if line.param else "none",
                line.param,
                whole_number(values.get(line.param)),
                line.does,
                line.warning,
                tuple(line.choices.items()),
            )
            for line in lines
        ]
        warnings = [line.when for line in lines if line.warning]
        if not self._services.failsafes.known(vehicle) and not values:
            return SetupFinding(SetupState.UNKNOWN, "its failsafes were not read"), fields
        if warnings:
            return SetupFinding(SetupState.ATTENTION, f"look at: {'; '.join(warnings)}"), fields
        does = next((line.does for line in lines if line.when in UNHEARD), "")
        return SetupFinding(SetupState.DONE, f"without a station: {does}" if does else "all are set"), fields

    def _motors(self, vehicle: Vehicle) -> Section:
        results, name = self._services.motor_tests.results(vehicle.id), name_of(vehicle)
        fields = [
            SetupFieldRow(
                motor_word(name, number),
                "motor",
                value=number,
                words=results[number].text if number in results else "not tested since this station began",
                needs_attention=number in results and not results[number].ok,
            )
            for number in range(1, motors(vehicle) + 1)
        ]
        bad = [str(number) for number, result in sorted(results.items()) if not result.ok]
        if bad:
            return SetupFinding(
                SetupState.ATTENTION, f"the test of motor {', '.join(bad)} did not show it turn"
            ), fields
        if len(results) < len(fields):
            text = f"{len(results)} of {len(fields)} tested since this station began"
            return SetupFinding(SetupState.UNKNOWN, text), fields
        return SetupFinding(SetupState.DONE, "each drove its output"), fields

    def _tuning(self, vehicle: Vehicle) -> Section:
        groups = self._services.tuning.groups(vehicle.id)
        known, former = self._services.params.table(vehicle.id).params, self._services.tuning.former(vehicle.id)
        fields = [
            SetupFieldRow(group.name, "gain", name, known[name].value, former=former.get(name, ()))
            for group in groups
            for name in group.names
            if name in known
        ]
        if not fields:
            return (SetupFinding(SetupState.UNKNOWN, "its gains were not read") if groups else NOT_KNOWN), fields
        text = f"changed from here: {', '.join(former)}" if former else "as it was found"
        return SetupFinding(SetupState.DONE, text), fields

    def _parameters(self, vehicle: Vehicle, parameters: Sequence[SetupParameter]) -> list[SetupFieldRow]:
        known = self._services.params.table(vehicle.id).params
        return [
            SetupFieldRow(
                each.label,
                "parameter",
                each.name,
                known[each.name].value if each.name in known else None,
                choices=tuple(each.choices.items()),
                unit=each.unit,
            )
            for each in parameters
        ]


def _names_of(parameters: Iterable[SetupParameter]) -> tuple[str, ...]:
    return tuple(each.name for each in parameters)


def _together(found: Sequence[tuple[str, SetupFinding]]) -> SetupFinding:
    """The finding of all sensors: the worst state, and which sensors it is about."""
    if not found:
        return SetupFinding(SetupState.UNKNOWN, "no parameter shows whether it was calibrated")
    for state in (SetupState.ATTENTION, SetupState.UNKNOWN):
        about = [(word, finding) for word, finding in found if finding.state is state]
        if about:
            return SetupFinding(state, "; ".join(f"{word}: {finding.text}" for word, finding in about))
    return SetupFinding(SetupState.DONE, f"calibrated: {', '.join(word for word, _ in found)}")
