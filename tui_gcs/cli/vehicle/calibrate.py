"""`tui-gcs vehicle calibrate`: calibrates sensors and transmitters, guided by the vehicles' prompts."""

import argparse
from collections.abc import Sequence
from typing import cast

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.vehicle.prompts import PromptGuide
from tui_gcs.cli.vehicle.station_client import (
    StationClient,
    VehicleOutcome,
    confirmed,
    lines_by_vehicle,
    not_sent,
    order,
    reports_by_vehicle,
    say,
    tell,
    tell_reply,
)
from tui_gcs.cli.vehicle_numbers import listed, vehicle_ids
from tui_gcs.core.protocol.services import GetTasks, ServiceReply, TaskInfo
from tui_gcs.core.protocol.setup import (
    Calibrate,
    CalibrationRow,
    CancelCalibration,
    ConfirmStep,
    GetCalibrations,
    SensorWord,
    UndoRadio,
)

Ids = tuple[int, ...]


def run(station: StationClient, arguments: argparse.Namespace) -> int:
    """List the sensors, begin a calibration, or act on those that are running."""
    ids, word = vehicle_ids(arguments.ids), arguments.sensor
    if word is None:
        return _list(station, ids, arguments)
    if arguments.undo:
        if word != "rc":
            raise CommandError("--undo: of the transmitter only (rc); sensors are calibrated again")
        return order(station, arguments, UndoRadio(ids))
    if word == "cancel":
        return order(station, arguments, CancelCalibration(ids))
    if word == "next":
        return tell(_confirm(station, ids), arguments)
    return _calibrate(station, ids, cast(SensorWord, word), arguments)


def _list(station: StationClient, ids: Ids, arguments: argparse.Namespace) -> int:
    reply = station.ask(GetCalibrations(ids))

    def rows(vehicle: int) -> list[CalibrationRow]:
        return [row for row in reply.calibrations if row.vehicle == vehicle]

    def lines(vehicle: int) -> list[str]:
        return [f"{vehicle:>4} {row.sensor:<12} {_begin_words(row)}" for row in rows(vehicle)]

    shown = lines_by_vehicle(reply, ids, lines, "this autopilot has none")
    entries = reports_by_vehicle(reply, ids, lambda vehicle: {"calibrations": rows(vehicle)})
    return tell_reply(arguments, reply, shown, entries)


def _begin_words(row: CalibrationRow) -> str:
    return row.prompt + (f" ({row.no_cancel})" if row.no_cancel else "")


def _calibrate(station: StationClient, ids: Ids, sensor: SensorWord, arguments: argparse.Namespace) -> int:
    """Calibrate; a calibration that is running already is joined, so that an interrupted user can come back."""
    joined = [info for info in _running(station, ids) if info.what == f"calibrate {sensor}"]
    rest = tuple(v for v in ids if all(info.vehicle != v for info in joined))
    rows = [row for row in station.ask(GetCalibrations(rest)).calibrations if row.sensor == sensor] if rest else []
    if rows and not arguments.yes:
        for words in dict.fromkeys(map(_begin_words, rows)):
            say(f"{listed([row.vehicle for row in rows if _begin_words(row) == words])}: {words}")
        if not confirmed(f"calibrate {sensor} of {listed(rest)}", yes=False):
            return not_sent(arguments)
    reply = station.begin(Calibrate(rest, sensor)) if rest else ServiceReply(ok=True)
    own = {info.vehicle: VehicleOutcome(info.vehicle, False, "forgotten", info.number) for info in joined}
    ended = {one.vehicle: one for one in station.finish(reply, PromptGuide(station), joined)}
    return tell([ended.get(v) or own[v] for v in ids], arguments)


def _running(station: StationClient, ids: Ids) -> Sequence[TaskInfo]:
    return [info for info in station.ask(GetTasks()).tasks if info.vehicle in ids and not info.over]


def _confirm(station: StationClient, ids: Ids) -> list[VehicleOutcome]:
    """Confirm that the vehicles lie as asked: for scripts, and for a second terminal."""
    waiting = {info.vehicle: info for info in _running(station, ids) if info.waits}
    ended = []
    for vehicle in ids:
        info = waiting.get(vehicle)
        if info is None:
            ended.append(VehicleOutcome(vehicle, False, "no task of it waits for a confirmation"))
        else:
            reply = station.ask(ConfirmStep(info.number))
            ended.append(
                VehicleOutcome(vehicle, reply.ok, f"done: {info.prompt}" if reply.ok else reply.text, info.number)
            )
    return ended
