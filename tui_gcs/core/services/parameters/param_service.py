"""Reads, sets and fetches the parameters of vehicles. Nothing is fetched unasked.

    params.read(1, ["FS_GCS_ENABLE"], on_done=lambda reading: ...)     # also in flight, beside any job
    params.set(1, "FS_GCS_ENABLE", 1, on_done=lambda setting: ...)     # setting.error == "" once it is confirmed
    params.fetch_all(1)                                                # a job; then params.table(1)

A reading or setting calls `on_done` once, when it is over. Every change of a parameter by this station is a `set`. It
checks the value against the range that the vehicle reports; where there is none, `setting.unchecked` is the reason.
"""

import struct
from collections import Counter
from collections.abc import Callable, Iterable

from tui_gcs.core.base.float32 import shown
from tui_gcs.core.base.text import clean
from tui_gcs.core.firmware import parameter_transport as firmware
from tui_gcs.core.firmware.airframes import changes_airframe
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import INFO, WARNING
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.files.ftp_sessions import FtpSessions
from tui_gcs.core.services.parameters.param_channel import ParamChannel, ParamTable, value_bytes
from tui_gcs.core.services.parameters.param_exchange import (
    MAX_NAMES_ASKED,
    NOT_KNOWN,
    ParamReading,
    ParamSetting,
    PendingRead,
    error_words,
)
from tui_gcs.core.services.parameters.param_fetch import ParamFetchJob
from tui_gcs.core.services.parameters.param_info import ParamMetadata, parse_info
from tui_gcs.core.services.parameters.param_values import (
    Number,
    Parameter,
    ParamValueError,
    check_name,
    param_type,
    read_value,
    wire_value,
)
from tui_gcs.core.services.vehicle.component_metadata import PARAMETERS, MetadataJob, MetadataService
from tui_gcs.core.uplink.jobs import Job, JobState

MAX_OPEN = 100
"""How many readings, and how many settings, may be under way at once."""


class ParamService:
    """Keeps the parameters of all vehicles, and reads and sets them."""

    def __init__(self, context: ServiceContext, ftp: FtpSessions, metadata: MetadataService) -> None:
        self.context = context
        self.channel = ParamChannel(context)
        self._ftp = ftp
        self._metadata = metadata
        self._infos: dict[int, dict[str, ParamMetadata]] = {}
        self._no_infos: dict[int, str] = {}
        """Why a vehicle's ranges could not be fetched, by vehicle."""
        self._unchecked: set[int] = set()
        """Vehicles of which other stations' values are not checked: their ranges could not be read."""
        self._info_jobs: dict[int, MetadataJob] = {}
        self._info_waits: dict[int, list[Callable[[str], None]]] = {}
        """What is to be called once the ranges of a vehicle are known, by vehicle."""
        self._readings: list[ParamReading] = []
        self._settings: dict[tuple[int, str], ParamSetting] = {}
        self.ignored: Counter[str] = Counter()
        """Parameter messages that were of no use, counted by reason."""
        context.fleet.on_message("PARAM_VALUE", self._on_value)
        context.fleet.on_message("PARAM_ERROR", self._on_error)
        context.forget_with(self._forget)

    def table(self, vehicle: int) -> ParamTable:
        """The table of the known parameters of a vehicle."""
        return self.channel.table(vehicle)

    def info(self, vehicle: int) -> dict[str, ParamMetadata]:
        """The descriptions of its parameters by name; empty until `fetch_info` is done."""
        return self._infos.get(vehicle, {})

    def fetch_all(self, vehicle: int, on_done: Callable[[Job], None] | None = None) -> ParamFetchJob:
        """Submit a job that fetches all parameters into `table`."""
        return self.context.jobs.submit(ParamFetchJob(self.channel, self._ftp, vehicle, on_done))

    def with_info(self, vehicle: int, then: Callable[[str], None]) -> MetadataJob | None:
        """Call `then` once the ranges of the parameters are known, or with the reason why they are not.

        The first time they are fetched from the vehicle by the job that is returned; questions meanwhile wait for the
        same job. No ArduPilot serves any.
        """
        known = self.context.fleet.vehicles.get(vehicle)
        why = self._no_infos.get(vehicle, "")
        if known is None or not firmware.describes_parameters(known):
            why = why or "the autopilot reports none"
        if vehicle in self._infos or why:
            then("" if vehicle in self._infos else why)
            return None
        waits = self._info_waits.setdefault(vehicle, [])
        waits.append(then)
        if len(waits) > 1:
            return self._info_jobs.get(vehicle)
        job = self.fetch_info(vehicle, self._end_waiting)
        if not job.over:
            self._info_jobs[vehicle] = job
        return job

    def foreign_problem(self, vehicle: Vehicle, name: str, kind: int, value: float) -> str:
        """Return why the PARAM_SET of another station is not to be passed on to a vehicle; "" if it may.

        The first one has the ranges fetched, and is refused until they are known: that station asks again.
        """

        def on_known(why: str) -> None:
            if why:
                self._unchecked.add(vehicle.id)

        known = param_type(kind)
        if known is None:
            return f"type {kind} is not known"
        if vehicle.id not in self._infos and vehicle.id not in self._unchecked:
            self.with_info(vehicle.id, on_known)
            if vehicle.id not in self._infos and vehicle.id not in self._unchecked:
                return self.waits_for(vehicle.id) or "the ranges of its parameters are read first"
        info = self.info(vehicle.id).get(name)
        number = read_value(known, struct.pack("<f", value), self.channel.encoding(vehicle))
        return info.why_not(number) if info is not None else ""

    def waits_for(self, vehicle: int) -> str:
        """What the settings of a vehicle wait for; "" if nothing."""
        job = self._info_jobs.get(vehicle)
        if job is None:
            return ""
        far = f", {100 * job.done // job.total} %" if job.total else ""
        return f"the ranges of its parameters are read first ({job.state.value}{far})"

    def _end_waiting(self, job: Job) -> None:
        """Go on with what waits for the ranges of a vehicle; a cancelled fetch cancels the settings that need it."""
        self._info_jobs.pop(job.vehicle, None)
        if job.state is JobState.CANCELLED:
            for setting in self._settings.values():
                if setting.vehicle == job.vehicle and setting.waits and not setting.over:
                    setting.end("cancelled")
            self._report_ended()
        for then in self._info_waits.pop(job.vehicle, []):
            then(self._no_infos.get(job.vehicle, job.error))

    def fetch_info(self, vehicle: int, on_done: Callable[[Job], None] | None = None) -> MetadataJob:
        """Submit a job that fetches meaning and range of the parameters from the vehicle; PX4 serves them."""

        def on_fetched(job: MetadataJob) -> None:
            infos = {} if job.error else parse_info(job.data)
            if infos:
                self._infos[vehicle] = infos
                self._no_infos.pop(vehicle, None)
            # One that was cancelled, or that no link carried, is tried again with the next setting.
            elif not job.error or job.state is JobState.FAILED:
                self._no_infos[vehicle] = job.error or "its description cannot be read"
            if on_done is not None:
                on_done(job)

        return self._metadata.fetch(vehicle, PARAMETERS, on_fetched)

    def read(
        self, vehicle: int, names: Iterable[str], on_done: Callable[[ParamReading], None] | None = None
    ) -> ParamReading:
        """Request some parameters by name, whether they are known or not."""
        reading = ParamReading(vehicle, on_done=on_done)
        for name in dict.fromkeys(names):
            why = check_name(name) or self.channel.unreachable(vehicle)
            if not why and len(reading.open) >= MAX_NAMES_ASKED:
                why = "too many at once"
            if why or len(self._readings) >= MAX_OPEN:
                reading.missing[clean(name, 40)] = why or "too many questions are open"
            else:
                reading.open[name] = PendingRead()
        self._readings.append(reading)
        self.tick()
        return reading

    def set(
        self,
        vehicle: int,
        name: str,
        value: Number,
        on_done: Callable[[ParamSetting], None] | None = None,
        *,
        beyond_range: bool = False,
        forbidden: Callable[[Vehicle], str] = lambda vehicle: "",
    ) -> ParamSetting:
        """Set a parameter and have it confirmed; before the first one the ranges are fetched from the vehicle.

        A setting of the same parameter that is under way is superseded.

        Args:
            vehicle: The vehicle's number.
            name: The name of the parameter.
            value: The new value.
            on_done: Called once, when the setting is over.
            beyond_range: The operator has said that the value may be outside of the range in the vehicle's description,
                or the vehicle held it before. The ranges are not fetched.
            forbidden: Returns why the vehicle must not be changed now, or ""; asked just before the value is sent.
        """
        setting = ParamSetting(vehicle, name, value, on_done)
        setting.check = lambda param, _: self._check_value(setting, param, forbidden, beyond_range=beyond_range)
        # Two settings of one parameter under way could confirm each other's value.
        before = self._settings.pop((vehicle, name), None)
        if before is not None:
            before.end("superseded")
            self._report(before)
        why = check_name(name) or self.channel.unreachable(vehicle)
        # PX4 stops its list when `_HASH_CHECK` is set (docs/autopilots.md "Parameters of PX4").
        if not why and name == firmware.hash_name(self.context.fleet.vehicles[vehicle]):
            why = "it is the checksum of all others"
        if not why and len(self._settings) >= MAX_OPEN:
            why = "too many are being set"
        if why:
            setting.end(why)
        self._settings[(vehicle, name)] = setting
        if not setting.over and not beyond_range:
            setting.waits = True
            self.with_info(vehicle, lambda unchecked: self._begin(setting, unchecked))
        else:
            self._begin(setting)
        return setting

    def _begin(self, setting: ParamSetting, unchecked: str = "") -> None:
        """Check and send the value if its type is known, else read it; `unchecked` is why no range is known."""
        setting.waits, setting.unchecked = False, unchecked
        setting.known = self.channel.table(setting.vehicle).params.get(setting.name)
        if not setting.over and setting.known is not None:
            why = setting.check(setting.known, setting.value)
            if why:
                setting.end(why)
        self.tick()

    def tick(self) -> None:
        """Repeat what is due, and report what is over."""
        now = self.channel.now
        for reading in self._readings:
            reading.tick(self.channel, now, slow=self.channel.is_slow(reading.vehicle))
        for setting in list(self._settings.values()):
            setting.tick(self.channel, now, slow=self.channel.is_slow(setting.vehicle))
        self._report_ended()

    def _on_value(self, vehicle: Vehicle, fields: Fields) -> None:
        name, index, count = fields["param_id"], fields["param_index"], fields["param_count"]
        kind = param_type(fields["param_type"])
        bits = value_bytes(vehicle, fields)
        if not name or kind is None or bits is None:
            self.ignored["parameter without name or type"] += 1
            return
        job = self.context.jobs.running(vehicle.id)
        fetching = job if isinstance(job, ParamFetchJob) else None
        if name == firmware.hash_name(vehicle):
            if fetching is not None:
                fetching.on_value(None, name, index, count, bits)
            return
        param = Parameter(name, read_value(kind, bits, self.channel.encoding(vehicle)), kind)
        if not self.channel.table(vehicle.id).put(param):
            self.ignored["parameter: too many names"] += 1
        if fetching is not None:
            fetching.on_value(param, name, index, count, bits)
        for reading in self._readings:
            if reading.vehicle == vehicle.id:
                reading.on_value(param)
        setting = self._settings.get((vehicle.id, name))
        if setting is not None:
            setting.on_value(param, self.channel, self.channel.now, slow=self.channel.is_slow(vehicle.id))
        self._report_ended()

    def _on_error(self, vehicle: Vehicle, fields: Fields) -> None:
        """Take a PARAM_ERROR by its name."""
        if not self.context.is_for_us(fields):
            self.ignored["parameter error for another station"] += 1
            return
        # The name counts: PX4's index is not to be trusted (docs/autopilots.md "Parameters of PX4").
        name, why = fields["param_id"], error_words(fields["error"])
        for reading in self._readings:
            if reading.vehicle == vehicle.id:
                reading.miss(name, why)
        setting = self._settings.get((vehicle.id, name))
        if setting is not None and not setting.over:
            setting.end(why)
        self._report_ended()

    def _forget(self, vehicle: Vehicle) -> None:
        """Forget the values of a vehicle that rebooted, was replaced or is gone."""
        self.channel.table(vehicle.id).forget()
        self._infos.pop(vehicle.id, None)
        self._no_infos.pop(vehicle.id, None)
        self._unchecked.discard(vehicle.id)
        for (number, _), setting in self._settings.items():
            if number == vehicle.id and not setting.over:
                setting.end(f"it rebooted: {NOT_KNOWN}" if setting.sent else "it rebooted")
        self._report_ended()

    def _report_ended(self) -> None:
        over = [reading for reading in self._readings if reading.over]
        if over:
            self._readings = [reading for reading in self._readings if not reading.over]
        ended = [(key, setting) for key, setting in self._settings.items() if setting.over]
        for key, _ in ended:
            del self._settings[key]
        for reading in over:
            if reading.on_done is not None:
                reading.on_done(reading)
        for _, setting in ended:
            self._report(setting)

    def _report(self, setting: ParamSetting) -> None:
        name = clean(setting.name, 40)
        # The error says that it may have been set.
        unsure = setting.error.endswith(NOT_KNOWN)
        text = f"parameter {name}{'' if unsure else ' NOT SET'}: {setting.error}"
        if not setting.error:
            text = f"{name} = {shown(setting.value)}"
        vehicle = self.context.fleet.vehicles.get(setting.vehicle)
        if vehicle is not None and setting.changed and changes_airframe(vehicle, setting.name):
            vehicle.reboot_first = "airframe changed"
        severity = WARNING if setting.error else INFO
        self.context.events.report(EventClass.MISSION, f"vehicle {setting.vehicle}", text, severity)
        if setting.on_done is not None:
            setting.on_done(setting)

    def _check_value(
        self, setting: ParamSetting, param: Parameter, forbidden: Callable[[Vehicle], str], *, beyond_range: bool
    ) -> str:
        known = self.context.fleet.vehicles.get(setting.vehicle)
        if known is None:
            return "unknown vehicle"
        try:
            wire_value(param.type, setting.value, self.channel.encoding(known))
        except ParamValueError as error:
            return str(error)
        info = self.info(setting.vehicle).get(param.name)
        why = info.why_not(setting.value) if info is not None and not beyond_range else ""
        setting.out_of_range = bool(why)
        return why or forbidden(known)
