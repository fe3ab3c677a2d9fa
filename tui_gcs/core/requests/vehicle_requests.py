"""Requests about parameters, plans, files, logs, modes, shell and reboot of a vehicle.

Each method begins one of them: it gets the vehicle, the request and a task, and returns "" or why it cannot begin; the
service that carries it out ends the task later.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from tui_gcs.core.base.float32 import shown
from tui_gcs.core.base.text import clean
from tui_gcs.core.firmware.base import may_be_flying
from tui_gcs.core.firmware.foreign_command_policy import MISSION_MODES
from tui_gcs.core.firmware.mode_change_policy import mode_change_policy
from tui_gcs.core.firmware.shell import why_no_shell
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.formats.content import counted
from tui_gcs.core.guard.permission import StopReason
from tui_gcs.core.mavlink.commands import CMD_REBOOT
from tui_gcs.core.plans.model import PlanKind, PlanWord
from tui_gcs.core.protocol import services as s
from tui_gcs.core.requests.handler import NotConfirmedError, VehicleAct, named
from tui_gcs.core.requests.mission_comparison import MissionComparison
from tui_gcs.core.requests.plan_rows import plan_of, plan_rows
from tui_gcs.core.requests.setup_requests import IN_THE_AIR, range_remark
from tui_gcs.core.requests.tasks import Task
from tui_gcs.core.services.all_services import Services
from tui_gcs.core.services.files.ftp import FtpJob
from tui_gcs.core.services.files.ftp_edit import FtpLister
from tui_gcs.core.services.files.log_transfer import LogEntry
from tui_gcs.core.services.files.logs import LogListJob
from tui_gcs.core.services.parameters.param_exchange import ParamReading, ParamSetting
from tui_gcs.core.services.parameters.param_service import ParamService
from tui_gcs.core.services.plans.plan_jobs import DownloadJob, PlanJob
from tui_gcs.core.services.vehicle.shell_job import ShellJob
from tui_gcs.core.station.assembly import StationParts
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass, VehicleAction
from tui_gcs.core.uplink.jobs import Job

REBOOT_S = 40.0
"""Seconds until a rebooted vehicle is heard again with a boot clock that began anew."""
ARMED, CANCELLED = "it is armed", "cancelled"


class VehicleRequests:
    """Begins requests about parameters, plans, files, logs, modes, shell and reboot, one method for each."""

    def __init__(self, parts: StationParts, comparison: MissionComparison) -> None:
        self._services, self._context = parts.services, parts.services.context
        self._firmware, self._encoder = parts.comms.firmware, parts.comms.command_encoder
        self._flight, self._comparison = parts.flight, comparison
        self.acts: dict[type, VehicleAct] = {
            s.ReadParams: VehicleAct(self._read_params, lambda r: "read " + clean(", ".join(r.names), 60)),
            s.FetchParams: VehicleAct(self._fetch_params, named("fetch parameters")),
            s.ReadFailsafes: VehicleAct(self._read_failsafes, named("read failsafes")),
            s.DownloadPlan: VehicleAct(self._download_plan, lambda r: f"download {r.kind}"),
            s.ListFiles: VehicleAct(self._list_files, _path_words("list")),
            s.DownloadFile: VehicleAct(self._download_file, _path_words("download")),
            s.ListLogs: VehicleAct(self._list_logs, named("list logs")),
            s.DownloadLog: VehicleAct(self._download_log, lambda r: f"download log {r.log}"),
            s.SetParams: VehicleAct(self._set_params, _set_words),
            s.UploadPlan: VehicleAct(self._upload_plan, lambda r: f"upload {r.kind} of {len(r.items)} items"),
            s.ClearPlan: VehicleAct(self._clear_plan, lambda r: f"clear {r.kind}"),
            s.SetMode: VehicleAct(self._set_mode, lambda r: f"mode {clean(r.mode, 30)}"),
            s.WriteFile: VehicleAct(self._write_file, _path_words("write")),
            s.RemoveFile: VehicleAct(self._remove_file, _path_words("remove")),
            s.EraseLogs: VehicleAct(self._erase_logs, named("erase logs")),
            s.TypeShell: VehicleAct(self._type_shell, lambda r: f"shell: {clean(r.line, 60)}"),
            s.Reboot: VehicleAct(self._reboot, named("reboot")),
        }

    def _follow(self, task: Task, job: Job) -> str:
        """Let the task follow the job; a job that could not even be queued has ended the task already."""
        if not task.over:
            task.follow(job, self._context.jobs)
        return ""

    def _read_params(self, vehicle: Vehicle, request: s.ReadParams, task: Task) -> str:
        if not request.names or len(request.names) > s.MAX_VALUES:
            return f"name 1 to {s.MAX_VALUES} parameters"

        def done(reading: ParamReading) -> None:
            rows = tuple(param_rows(self._services.params, vehicle.id, tuple(reading.values)))
            why = "; ".join(f"{name}: {reason}" for name, reason in reading.missing.items())
            task.end(why, result=s.TaskResult(params=rows, missing=dict(reading.missing)))

        reading = self._services.params.read(vehicle.id, request.names, done)
        if not task.over:
            task.progress = lambda: (len(reading.values), len(request.names))
            task.stop = partial(_give_up, reading)
        return ""

    def _fetch_params(self, vehicle: Vehicle, request: s.FetchParams, task: Task) -> str:
        params = self._services.params

        def end(_: str = "") -> None:
            task.end(text=f"{len(params.table(vehicle.id).params)} parameters")

        def done(job: Job) -> None:
            if job.error:
                task.end(job.error)
            elif not request.meanings:
                end()
            elif task.begin_next_part():
                infos = params.with_info(vehicle.id, end)
                if infos is not None and not infos.over:
                    self._follow(task, infos)

        return self._follow(task, self._services.params.fetch_all(vehicle.id, done))

    def _set_params(self, vehicle: Vehicle, request: s.SetParams, task: Task) -> str:
        if not request.values or len(request.values) > s.MAX_VALUES:
            return f"name 1 to {s.MAX_VALUES} parameters"
        if may_be_flying(vehicle) and not request.in_flight:
            raise NotConfirmedError(IN_THE_AIR)
        params, ended = self._services.params, list[ParamSetting]()

        def done(setting: ParamSetting) -> None:
            ended.append(setting)
            if len(ended) == len(request.values):
                bad = [f"{clean(one.name, 20)}: {one.error}" for one in ended if one.error]
                names = tuple(one.name for one in ended if not one.error)
                rows = tuple(param_rows(params, vehicle.id, names))
                beyond = tuple(one.name for one in ended if one.out_of_range)
                remark = range_remark(next((one.unchecked for one in ended if one.unchecked), ""))
                task.end("; ".join(bad), text=remark, result=s.TaskResult(params=rows, out_of_range=beyond))

        def forbidden(now: Vehicle) -> str:
            # It may have taken off while the ranges were fetched.
            return IN_THE_AIR if may_be_flying(now) and not request.in_flight else ""

        settings = [
            params.set(vehicle.id, name, value, done, beyond_range=request.beyond_range, forbidden=forbidden)
            for name, value in request.values.items()
        ]
        if not task.over:
            task.progress = lambda: (len(ended), len(settings))
            task.waits_for = partial(params.waits_for, vehicle.id)
            task.stop = partial(_end_all, settings)
        return ""

    def _read_failsafes(self, vehicle: Vehicle, request: s.ReadFailsafes, task: Task) -> str:
        self._services.failsafes.ask(
            vehicle.id, lambda: task.end(result=s.TaskResult(failsafes=failsafe_rows(self._services, vehicle)))
        )
        return ""

    def _download_plan(self, vehicle: Vehicle, request: s.DownloadPlan, task: Task) -> str:
        def done(job: Job) -> None:
            plan = job.plan if isinstance(job, DownloadJob) else None
            problem = job.problems[0] if isinstance(job, DownloadJob) and job.problems else ""
            task.end(job.error, text=problem, result=s.TaskResult(plan=plan_rows(plan)) if plan is not None else None)

        return self._follow(task, self._services.missions.download(vehicle.id, _kind(request.kind), done))

    def _upload_plan(self, vehicle: Vehicle, request: s.UploadPlan, task: Task) -> str:
        plan = plan_of(_kind(request.kind), request.items)
        if not plan.items:
            return "there is nothing in it: clear it instead"
        done = self._plan_done(task, counted(len(plan.items), "item"))
        return self._follow(task, self._services.missions.upload(vehicle.id, plan, done, in_flight=request.in_flight))

    def _clear_plan(self, vehicle: Vehicle, request: s.ClearPlan, task: Task) -> str:
        done = self._plan_done(task, "it holds none")
        return self._follow(task, self._services.missions.clear(vehicle.id, _kind(request.kind), done))

    def _plan_done(self, task: Task, text: str) -> Callable[[Job], None]:
        def done(job: Job) -> None:
            notes = job.notes if isinstance(job, PlanJob) else []
            task.end(job.error, text="; ".join([text, *notes]))

        return done

    def _list_files(self, vehicle: Vehicle, request: s.ListFiles, task: Task) -> str:
        def done(job: Job) -> None:
            lister = job.task if isinstance(job, FtpJob) else None
            entries = lister.entries if isinstance(lister, FtpLister) else []
            rows = tuple(
                s.FileRow(name=e.name, is_directory=e.is_directory, size=e.size, exact=e.exact) for e in entries
            )
            task.end(job.error, result=s.TaskResult(files=rows))

        return self._follow(task, self._services.ftp.list(vehicle.id, request.path, done))

    def _download_file(self, vehicle: Vehicle, request: s.DownloadFile, task: Task) -> str:
        return self._follow(task, self._services.ftp.download(vehicle.id, request.path, _with_path(task)))

    def _write_file(self, vehicle: Vehicle, request: s.WriteFile, task: Task) -> str:
        if vehicle.telemetry.armed:
            return ARMED
        if request.path.lstrip("/").upper().startswith("@PARAM/"):
            return "parameters are set by `params load`, which checks each of them"
        if len(request.data) > s.MAX_FILE_BYTES:
            return f"more than {s.MAX_FILE_BYTES >> 20} MB"
        # Virtual files ("@PARAM/...") are made while they are written: they have no checksum.
        verify = not request.path.lstrip("/").startswith("@")
        job = self._services.ftp.write(
            vehicle.id, request.path, request.data, lambda j: task.end(j.error), verify=verify
        )
        job.only_disarmed = True
        return self._follow(task, job)

    def _remove_file(self, vehicle: Vehicle, request: s.RemoveFile, task: Task) -> str:
        if vehicle.telemetry.armed:
            return ARMED
        job = self._services.ftp.remove(vehicle.id, request.path, lambda j: task.end(j.error))
        job.only_disarmed = True
        return self._follow(task, job)

    def _list_logs(self, vehicle: Vehicle, request: s.ListLogs, task: Task) -> str:
        def done(job: Job) -> None:
            entries = job.entries if isinstance(job, LogListJob) else []
            rows = tuple(s.LogRow(id=e.id, size=e.size, time_utc=e.time_utc) for e in entries)
            task.end(job.error, result=s.TaskResult(logs=rows))

        return self._follow(task, self._services.logs.list(vehicle.id, done))

    def _download_log(self, vehicle: Vehicle, request: s.DownloadLog, task: Task) -> str:
        # The job asks for the length itself: the list may be older than the log.
        entry = LogEntry(request.log, 0, 0)
        return self._follow(task, self._services.logs.download(vehicle.id, entry, _with_path(task)))

    def _erase_logs(self, vehicle: Vehicle, request: s.EraseLogs, task: Task) -> str:
        if vehicle.telemetry.armed:
            return ARMED
        return self._follow(task, self._services.logs.erase(vehicle.id, lambda job: task.end(job.error)))

    def _set_mode(self, vehicle: Vehicle, request: s.SetMode, task: Task) -> str:
        modes = self._services.modes
        number = modes.number(vehicle, request.mode)
        if number is None:
            modes.want(vehicle)
            return f"it has no mode {clean(request.mode, 30)}"
        policy = mode_change_policy(vehicle, number)
        if policy.danger and not request.sure:
            raise NotConfirmedError(policy.danger)
        if vehicle.why_not_commanded and policy.retry is not RetryClass.STOP:
            return vehicle.why_not_commanded
        remarks: list[str] = []

        def done(action: VehicleAction, outcome: Outcome, why: str) -> None:
            ok = outcome is Outcome.CONFIRMED
            self._mode_ended(vehicle, number, ok=ok)
            text = "; ".join([f"in {modes.name(vehicle)}", *remarks])
            task.end("" if ok else ": ".join(part for part in (outcome.value, why) if part), text=text)

        try:
            action = self._firmware.of(vehicle).mode(vehicle, number, policy.name, policy.retry, done)
        except ValueError as error:
            return str(error)
        # Only a heartbeat that came after the order counts: an older one may show the same mode.
        shown = action.confirmed
        action.confirmed = lambda v: v.telemetry.heartbeat_s > action.first_s and shown(v)
        task.stop = lambda: self._context.commands.cancel(vehicle.id, action.name)
        action.by = task.who
        if policy.is_stop:
            action.stop = StopReason(policy.name, task.who)

        def begin(remark: str) -> None:
            remarks.extend([remark] if remark else [])
            stop = policy.name if policy.retry is RetryClass.STOP else ""
            self._flight.executive.mode_ordered(vehicle, number, stop)
            self._context.commands.submit(action)

        if modes.name(vehicle, number) not in MISSION_MODES or request.meet:
            begin("")
            return ""
        return self._comparison.begin(vehicle, request.vehicles, task, begin)

    def _mode_ended(self, vehicle: Vehicle, number: int, *, ok: bool) -> None:
        """A mode that was ordered is confirmed or not: what the vehicle does next is judged by that."""
        if not ok:
            self._flight.executive.mode_refused(vehicle, number)
        elif self._flight.flights.get(vehicle.id) is None:  # the executive watches vehicles of teams
            if self._services.modes.name(vehicle, number) in MISSION_MODES:
                self._flight.courses.watch_mission(vehicle.id)
            else:
                self._flight.flights.sent.discard(vehicle.id)

    def _type_shell(self, vehicle: Vehicle, request: s.TypeShell, task: Task) -> str:
        if why := why_no_shell(vehicle) or (ARMED if vehicle.telemetry.armed else ""):
            return why

        def done(_: Job) -> None:
            task.end(job.error, result=s.TaskResult(lines=tuple(job.lines)))

        job = ShellJob(self._services.shell, vehicle.id, task.who, request.line, done)
        self._context.jobs.submit(job)
        return self._follow(task, job)

    def _reboot(self, vehicle: Vehicle, request: s.Reboot, task: Task) -> str:
        """Reboot the vehicle by a start-class order: repeated later it might reboot it twice, or in the air."""
        if vehicle.telemetry.armed:
            return ARMED
        before = vehicle.integrity.reboots

        def done(action: VehicleAction, outcome: Outcome, why: str) -> None:
            ok = vehicle.integrity.reboots > before
            task.end("" if ok else ": ".join(part for part in (outcome.value, why) if part), text="it has rebooted")

        order = MavCommand(CMD_REBOOT, (1.0,))
        action = self._encoder.action(
            vehicle.id,
            "reboot",
            RetryClass.START,
            order,
            lambda v: v.integrity.reboots > before,
            done,
            confirm_s=REBOOT_S,
            confirmed_by=None,
        )
        action.by = task.who
        self._context.commands.submit(action)
        return ""


def _path_words(verb: str) -> Callable[[Any], str]:
    return lambda request: f"{verb} {clean(request.path, 60)}"


def _set_words(request: s.SetParams) -> str:
    return "set " + ", ".join(f"{clean(name, 20)} = {shown(value)}" for name, value in request.values.items())


def param_rows(params: ParamService, vehicle: int, names: tuple[str, ...] | None = None) -> list[s.ParamRow]:
    """Rows of the parameters that are known (of these names), sorted by name."""
    table, infos = params.table(vehicle).params, params.info(vehicle)
    rows = []
    for name in sorted(table) if names is None else names:
        param, info = table.get(name), infos.get(name)
        if param is not None:
            text, units = (info.short, info.units) if info is not None else ("", "")
            kind = param.type.name.lower()
            rows.append(
                s.ParamRow(name=param.name, value=param.value, type=kind, default=param.default, text=text, units=units)
            )
    return rows


def param_info_rows(params: ParamService, vehicle: int, names: tuple[str, ...]) -> list[s.ParamInfoRow]:
    """Rows of a vehicle's own descriptions of these parameters, without those that it does not describe."""
    infos = params.info(vehicle)
    return [
        s.ParamInfoRow(
            name=info.name,
            text=info.long or info.short,
            units=info.units,
            group=info.group,
            least=info.least,
            most=info.most,
            reboot=info.reboot,
            choices=tuple(info.choices.items()),
            bits=tuple(info.bits.items()),
        )
        for info in map(infos.get, names)
        if info is not None
    ]


def failsafe_rows(services: Services, vehicle: Vehicle) -> tuple[s.FailsafeRow, ...]:
    """Rows of what a vehicle does when a link, position or battery is lost."""
    lines = services.failsafes.report(vehicle)
    return tuple(s.FailsafeRow(when=line.when, does=line.does, warning=line.warning) for line in lines)


def _kind(word: PlanWord) -> PlanKind:
    return PlanKind[word.upper()]


def _give_up(reading: ParamReading) -> None:
    for name in tuple(reading.open):
        reading.miss(name, CANCELLED)


def _end_all(settings: list[ParamSetting]) -> None:
    for setting in settings:
        if not setting.over:
            setting.end(CANCELLED)


def _with_path(task: Task) -> Callable[[Job], None]:
    """A function that ends the task with the path of the file that a job wrote."""
    return lambda job: task.end(job.error, result=s.TaskResult(path=getattr(job, "path", "")))
