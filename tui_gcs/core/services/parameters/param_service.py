"""Parameters of vehicles: read, set, fetched as a whole; nothing is fetched unasked.

params.read(1, ["FS_GCS_ENABLE"], on_done=lambda reading: ...)     # also in flight, beside any job
params.set(1, "FS_GCS_ENABLE", 1, on_done=lambda setting: ...)     # setting.error == "" when the vehicle says so
params.fetch_all(1)                                                # a job; then params.table(1)
"""

from collections import Counter
from collections.abc import Callable, Iterable

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
    shown,
    wire_value,
)
from tui_gcs.core.services.vehicle.component_metadata import PARAMETERS, MetadataJob, MetadataService
from tui_gcs.core.uplink.jobs import Job

MAX_OPEN = 100
"""Readings and settings under way."""


class ParamService:
    """Knows what vehicles said of their parameters, and asks for more."""

    def __init__(self, context: ServiceContext, ftp: FtpSessions, metadata: MetadataService) -> None:
        """Listen from now on."""
        self.context = context
        self.channel = ParamChannel(context)
        self._ftp = ftp
        self._metadata = metadata
        self._infos: dict[int, dict[str, ParamMetadata]] = {}
        self._readings: list[ParamReading] = []
        self._settings: dict[tuple[int, str], ParamSetting] = {}
        self.ignored: Counter[str] = Counter()
        """What came and was of no use, by reason."""
        context.fleet.on_message("PARAM_VALUE", self._on_value)
        context.fleet.on_message("PARAM_ERROR", self._on_error)
        context.fleet.on_gone(self._forget)
        context.fleet.paths.on_reboot.append(self._forget)
        context.fleet.paths.on_replace.append(self._forget)

    # ---------------------------------------------------------------- for others

    def table(self, vehicle: int) -> ParamTable:
        """What is known of a vehicle's parameters."""
        return self.channel.table(vehicle)

    def info(self, vehicle: int) -> dict[str, ParamMetadata]:
        """What its parameters mean, by name; empty until `fetch_info` was done."""
        return self._infos.get(vehicle, {})

    def fetch_all(self, vehicle: int, on_done: Callable[[Job], None] | None = None) -> ParamFetchJob:
        """Fetch all parameters into `table`."""
        job = ParamFetchJob(self.channel, self._ftp, vehicle, on_done)
        self.context.jobs.submit(job)
        return job

    def fetch_info(self, vehicle: int, on_done: Callable[[Job], None] | None = None) -> MetadataJob:
        """Fetch what the vehicle says of the meaning and range of its parameters (PX4 does)."""

        def take(job: MetadataJob) -> None:
            if not job.error:
                self._infos[vehicle] = parse_info(job.data)
            if on_done is not None:
                on_done(job)

        return self._metadata.fetch(vehicle, PARAMETERS, take)

    def read(
        self, vehicle: int, names: Iterable[str], on_done: Callable[[ParamReading], None] | None = None
    ) -> ParamReading:
        """Ask for some parameters by name, whatever is known of them."""
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
    ) -> ParamSetting:
        """Set a parameter and have it confirmed. `beyond_range`: though its description says it is out of range.

        A setting of the same parameter that is under way is superseded.
        """
        setting = ParamSetting(vehicle, name, value, on_done)
        setting.judge = lambda param, number: self._judge(vehicle, param, number, beyond_range=beyond_range)
        setting.known = self.channel.table(vehicle).params.get(name)
        before = self._settings.pop((vehicle, name), None)
        if before is not None:
            before.end("superseded")
            self._tell(before)
        why = check_name(name) or self.channel.unreachable(vehicle)
        if not why and name == firmware.hash_name(self.context.fleet.vehicles[vehicle]):
            why = "it is the checksum of all others"
        if not why and len(self._settings) >= MAX_OPEN:
            why = "too many are being set"
        if not why and setting.known is not None:
            why = setting.judge(setting.known, value)
        if why:
            setting.end(why)
        self._settings[(vehicle, name)] = setting
        self.tick()
        return setting

    def tick(self) -> None:
        """Ask what is due, tell what is over."""
        now = self.channel.now
        for reading in self._readings:
            reading.tick(self.channel, now, slow=self.channel.is_slow(reading.vehicle))
        for setting in list(self._settings.values()):
            setting.tick(self.channel, now, slow=self.channel.is_slow(setting.vehicle))
        self._tell_all()

    # ---------------------------------------------------------------- answers

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
                fetching.heard(None, name, index, count, bits)
            return
        param = Parameter(name, read_value(kind, bits, self.channel.encoding(vehicle)), kind)
        if not self.channel.table(vehicle.id).put(param):
            self.ignored["parameter: too many names"] += 1
        if fetching is not None:
            fetching.heard(param, name, index, count, bits)
        for reading in self._readings:
            if reading.vehicle == vehicle.id:
                reading.hear(param)
        setting = self._settings.get((vehicle.id, name))
        if setting is not None:
            setting.hear(param, self.channel, self.channel.now, slow=self.channel.is_slow(vehicle.id))
        self._tell_all()

    def _on_error(self, vehicle: Vehicle, fields: Fields) -> None:
        """By name: its index is not to be trusted (docs/autopilots.md)."""
        if not self.context.is_for_us(fields):
            self.ignored["parameter error for another station"] += 1
            return
        name, why = fields["param_id"], error_words(fields["error"])
        for reading in self._readings:
            if reading.vehicle == vehicle.id:
                reading.miss(name, why)
        setting = self._settings.get((vehicle.id, name))
        if setting is not None and not setting.over:
            setting.end(why)
        self._tell_all()

    def _forget(self, vehicle: Vehicle) -> None:
        """It rebooted, is another one, or gone: what was known is to be read again."""
        self.channel.table(vehicle.id).forget()
        self._infos.pop(vehicle.id, None)
        for (number, _), setting in self._settings.items():
            if number == vehicle.id and not setting.over:
                setting.end(f"it rebooted: {NOT_KNOWN}" if setting.sent else "it rebooted")
        self._tell_all()

    def _tell_all(self) -> None:
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
            self._tell(setting)

    def _tell(self, setting: ParamSetting) -> None:
        name = clean(setting.name, 40)
        unsure = setting.error.endswith(NOT_KNOWN)  # it says itself that it may have been set
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

    def _judge(self, vehicle: int, param: Parameter, value: Number, *, beyond_range: bool) -> str:
        known = self.context.fleet.vehicles.get(vehicle)
        if known is None:
            return "unknown vehicle"
        try:
            wire_value(param.type, value, self.channel.encoding(known))
        except ParamValueError as error:
            return str(error)
        info = self.info(vehicle).get(param.name)
        return info.why_not(value) if info is not None and not beyond_range else ""
