"""Requests about setting up a vehicle: calibrations, gains, airframe, motor tests."""

from collections.abc import Iterable
from functools import partial

from tui_gcs.core.base.float32 import shown, whole_number
from tui_gcs.core.base.text import clean
from tui_gcs.core.firmware.base import may_be_flying
from tui_gcs.core.firmware.calibration_setup import calibration, motor_word
from tui_gcs.core.firmware.registry import name_of
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol import setup as s
from tui_gcs.core.protocol.services import TaskResult
from tui_gcs.core.requests.handler import NotConfirmedError, VehicleAct, named
from tui_gcs.core.requests.setup_overview import RADIO_FIRST, SENSORS
from tui_gcs.core.requests.tasks import Guidance, Task
from tui_gcs.core.services.all_services import Services
from tui_gcs.core.services.parameters.param_change import ParamChange
from tui_gcs.core.services.parameters.param_exchange import ParamReading, ParamSetting
from tui_gcs.core.services.setup.calibration import CalibrationJob
from tui_gcs.core.services.setup.rc_calibration import ORDER, RcCalibration
from tui_gcs.core.services.setup.tuning import FORCE
from tui_gcs.core.uplink.actions import Outcome
from tui_gcs.core.uplink.jobs import Job, JobState

REBOOT_FIRST = "; reboot it before it flies"
IN_THE_AIR = "it is in the air"


class SetupRequests:
    """Begins requests about calibration, gains, airframe and motor tests, one method for each."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._jobs = services.context.jobs
        self.acts: dict[type, VehicleAct] = {
            s.Calibrate: VehicleAct(self._calibrate, lambda r: f"calibrate {r.sensor}"),
            s.CancelCalibration: VehicleAct(self._cancel_calibration, named("cancel calibration")),
            s.UndoRadio: VehicleAct(self._undo_radio, named("undo rc")),
            s.ReadGains: VehicleAct(self._read_gains, lambda r: f"read gains {clean(r.group, 20)}".strip()),
            s.SetGain: VehicleAct(self._set_gain, lambda r: f"set {clean(r.name, 20)} = {shown(r.value)}"),
            s.UndoGains: VehicleAct(self._undo_gains, lambda r: f"undo {clean(r.name, 20) or 'all gains'}"),
            s.ReadAirframe: VehicleAct(self._read_airframe, named("read airframe")),
            s.ChooseAirframe: VehicleAct(self._choose_airframe, lambda r: f"airframe {clean(' '.join(r.words), 60)}"),
            s.TestMotor: VehicleAct(
                self._test_motor, lambda r: f"test of motor {r.motor}: {100 * r.throttle:.0f} %, {r.seconds:g} s"
            ),
        }

    def calibrations(self, vehicles: Iterable[Vehicle]) -> tuple[s.CalibrationRow, ...]:
        """Rows of the calibrations that these vehicles have."""
        rows: list[s.CalibrationRow] = []
        for vehicle in vehicles:
            found = [(word, calibration(vehicle, sensor)) for word, sensor in SENSORS.items()]
            own = [s.CalibrationRow(vehicle.id, word, c.prompt, c.no_cancel) for word, c in found if c is not None]
            rows += [*own, s.CalibrationRow(vehicle.id, "rc", RADIO_FIRST)] if own else []
        return tuple(rows)

    def _calibrate(self, vehicle: Vehicle, request: s.Calibrate, task: Task) -> str:
        if request.sensor == "rc":
            return self._calibrate_radio(vehicle, task)

        def done(ended: Job) -> None:
            text = ended.result if isinstance(ended, CalibrationJob) else ""
            reboot = REBOOT_FIRST if isinstance(ended, CalibrationJob) and ended.needs_reboot else ""
            task.end(ended.error and ended.error + reboot, text=text + reboot)

        job = self._services.calibrations.start(vehicle.id, SENSORS[request.sensor], done)
        if isinstance(job, str):
            return job
        if not task.over:
            task.follow(job, self._jobs)
            task.stop = partial(self._services.calibrations.cancel, vehicle.id)
            task.confirm = partial(self._services.calibrations.confirm, vehicle.id)
            task.guidance = lambda: Guidance(job.prompt, job.waits, job.lines, tuple(job.notes))
        return ""

    def _calibrate_radio(self, vehicle: Vehicle, task: Task) -> str:
        def done(ended: RcCalibration) -> None:
            change = ended.change
            changed = _and(f"{len(change.changed)} parameters written", change.unchecked) if change is not None else ""
            reboot = REBOOT_FIRST if ended.needs_reboot else ""
            task.end(ended.error, text=changed + reboot, cancelled=ended.cancelled)

        session = self._services.rc_calibrations.start(vehicle.id, done)
        if isinstance(session, str):
            return session
        task.progress = lambda: (ORDER.index(session.step) if session.step in ORDER else 0, len(ORDER))
        task.stop = partial(self._services.rc_calibrations.cancel, vehicle.id)
        task.confirm = partial(self._services.rc_calibrations.confirm, vehicle.id)
        task.guidance = lambda: Guidance(session.prompt, bool(session.prompt), session.lines())
        return ""

    def _cancel_calibration(self, vehicle: Vehicle, request: s.CancelCalibration, task: Task) -> str:
        radio = self._services.rc_calibrations.of(vehicle.id)
        if radio is not None and not radio.over:
            why = self._services.rc_calibrations.cancel(vehicle.id)
            if not why:
                task.end(text="cancelled")
            return why
        job = self._services.calibrations.of(vehicle.id)
        if job is None or job.over:
            return "no calibration is under way"
        # The task that began the calibration ends too, and with the same reason.
        former_done = job.on_done

        def done(ended: Job) -> None:
            if former_done is not None:
                former_done(ended)
            good = ended.state is JobState.CANCELLED
            text = "cancelled" + REBOOT_FIRST * job.needs_reboot
            task.end("" if good else f"not cancelled: {ended.error or 'it was done first'}", text=text)

        job.on_done = done
        why = self._services.calibrations.cancel(vehicle.id)
        if why:
            job.on_done = former_done
        return why

    def _undo_radio(self, vehicle: Vehicle, request: s.UndoRadio, task: Task) -> str:
        change = self._services.rc_calibrations.undo(vehicle.id, lambda ended: _changed(task, ended, "set back"))
        return change if isinstance(change, str) else ""

    def _read_gains(self, vehicle: Vehicle, request: s.ReadGains, task: Task) -> str:
        tuning = self._services.tuning
        groups = [group.name for group in tuning.groups(vehicle.id)]
        wanted = [name for name in groups if not request.group or name == request.group]
        if not wanted:
            return f"its groups of gains are {', '.join(groups)}" if groups else "its gains are not known"
        ended: list[ParamReading] = []

        def done(reading: ParamReading) -> None:
            ended.append(reading)
            if len(ended) == len(wanted):
                rows = tuple(self._gain_rows(vehicle.id, wanted))
                missing = {name: why for one in ended for name, why in one.missing.items()}
                task.end("" if rows else "it reported none", result=TaskResult(gains=rows, missing=missing))

        for name in wanted:
            tuning.read(vehicle.id, name, done)
        return ""

    def _gain_rows(self, vehicle: int, groups: list[str]) -> list[s.GainRow]:
        known, former = self._services.params.table(vehicle).params, self._services.tuning.former(vehicle)
        return [
            s.GainRow(group.name, name, known[name].value, former.get(name, ()))
            for group in self._services.tuning.groups(vehicle)
            for name in group.names
            if group.name in groups and name in known
        ]

    def _set_gain(self, vehicle: Vehicle, request: s.SetGain, task: Task) -> str:
        if may_be_flying(vehicle) and not request.sure:
            raise NotConfirmedError(IN_THE_AIR)
        why = self._services.tuning.set(
            vehicle.id,
            request.name,
            request.value,
            partial(self._gain_set, task),
            force=request.sure,
            beyond_range=request.beyond_range,
        )
        if not task.over:
            task.waits_for = partial(self._services.params.waits_for, vehicle.id)
        if why.endswith(FORCE):
            raise NotConfirmedError(why.removesuffix(FORCE))
        return why

    def _gain_set(self, task: Task, setting: ParamSetting) -> None:
        held = self._services.params.table(setting.vehicle).params.get(setting.name)
        was = self._services.tuning.former(setting.vehicle).get(setting.name, ())
        text = f"{setting.name} = {shown(held.value)}" if held is not None else setting.name
        text += f"; was {', '.join(map(shown, was))}" if was else ""
        beyond = (setting.name,) if setting.out_of_range else ()
        task.end(setting.error, text=_and(text, setting.unchecked), result=TaskResult(out_of_range=beyond))

    def _undo_gains(self, vehicle: Vehicle, request: s.UndoGains, task: Task) -> str:
        tuning = self._services.tuning
        if request.name:
            return tuning.undo(vehicle.id, request.name, partial(self._gain_set, task))
        change = tuning.undo_all(vehicle.id, lambda ended: _changed(task, ended, "set back"))
        return change if isinstance(change, str) else ""

    def airframe_rows(self, vehicles: Iterable[Vehicle]) -> tuple[s.AirframeRow, ...]:
        """Rows of what can be chosen for their airframes, with the present values as far as they are known."""
        return tuple(row for vehicle in vehicles for row in self._airframe_rows(vehicle))

    def _airframe_rows(self, vehicle: Vehicle) -> tuple[s.AirframeRow, ...]:
        words, known = self._services.airframes.parameters(vehicle.id), self._services.params.table(vehicle.id).params
        if words is None:
            return ()
        return tuple(
            s.AirframeRow(
                vehicle=vehicle.id,
                label=field.label,
                param=field.param,
                least=field.least,
                most=field.most,
                choices=field.choices,
                warning=words.warning,
                value=whole_number(known[field.param].value) if field.param in known else None,
            )
            for field in words.fields
        )

    def _read_airframe(self, vehicle: Vehicle, request: s.ReadAirframe, task: Task) -> str:
        def done(reading: ParamReading) -> None:
            why = "; ".join(f"{name}: {reason}" for name, reason in reading.missing.items())
            task.end(why, result=TaskResult(airframe=self._airframe_rows(vehicle)))

        reading = self._services.airframes.read(vehicle.id, done)
        return reading if isinstance(reading, str) else ""

    def _choose_airframe(self, vehicle: Vehicle, request: s.ChooseAirframe, task: Task) -> str:
        words = self._services.airframes.parameters(vehicle.id)
        if words is None:
            return "its airframe is not known"
        values = words.values(request.words)
        if isinstance(values, str):
            return values
        change = self._services.airframes.choose(
            vehicle.id, values, lambda ended: _changed(task, ended, f"set; {words.warning}")
        )
        return change if isinstance(change, str) else ""

    def _test_motor(self, vehicle: Vehicle, request: s.TestMotor, task: Task) -> str:
        def done(outcome: Outcome, why: str) -> None:
            ok, motor = outcome is Outcome.CONFIRMED, motor_word(name_of(vehicle), request.motor)
            task.end("" if ok else why or outcome.value, text=f"{motor}: {why}")

        why = self._services.motor_tests.start(
            vehicle.id,
            request.motor,
            props_removed=request.props_removed,
            throttle=request.throttle,
            seconds=request.seconds,
            on_done=done,
        )
        if not why and not task.over:
            task.stop = partial(self._services.motor_tests.stop, vehicle.id)
        return why


def _changed(task: Task, change: ParamChange, text: str) -> None:
    names = ", ".join(change.changed)
    task.end(change.error, text=_and(f"{names} {text}", change.unchecked) if names else "nothing had to be changed")


def range_remark(unchecked: str) -> str:
    """The remark that ranges are not known, with the reason `unchecked`; "" without a reason."""
    return f"range not checked: {unchecked}" if unchecked else ""


def _and(text: str, unchecked: str) -> str:
    return "; ".join(filter(None, (text, range_remark(unchecked))))
