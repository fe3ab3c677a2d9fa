"""`tui-gcs vehicle files` and `logs`: files on vehicles, and their copies here."""

import argparse
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.files.file_access import may_write, put
from tui_gcs.cli.vehicle.station_client import (
    StationClient,
    VehicleOutcome,
    confirmed,
    not_sent,
    order,
    tell,
    tell_lines,
)
from tui_gcs.cli.vehicle_numbers import listed, only_one, vehicle_ids
from tui_gcs.core.base.directories import ConfigError, state_dir
from tui_gcs.core.base.regular_file import open_plain
from tui_gcs.core.protocol.services import (
    MAX_FILE_BYTES,
    DownloadFile,
    DownloadLog,
    EraseLogs,
    ListFiles,
    ListLogs,
    RemoveFile,
    WriteFile,
)


def run_files(station: StationClient, arguments: argparse.Namespace) -> int:
    """Run one of the actions on files."""
    return {"ls": _ls, "get": _get, "put": _put, "rm": _rm}[arguments.act](station, arguments)


def run_logs(station: StationClient, arguments: argparse.Namespace) -> int:
    """Run one of the actions on logs."""
    return {"ls": _list_logs, "get": _get_log, "erase": _erase}[arguments.act](station, arguments)


# ---------------------------------------------------------------- files


def _ls(station: StationClient, arguments: argparse.Namespace) -> int:
    ended = station.carry_out(ListFiles(vehicle_ids(arguments.ids), arguments.path))
    return tell_lines(ended, _file_lines, arguments, "files")


def _file_lines(one: VehicleOutcome) -> Iterator[str]:
    for row in one.result.files:
        size = "dir" if row.is_directory else "?" if row.size is None else str(row.size)
        yield f"{one.vehicle:>4} {size:>12} {row.name}" + ("" if row.exact else "  (not its exact name)")
    if one.ok and not one.result.files:
        yield f"vehicle {one.vehicle}: nothing is there"


def _get(station: StationClient, arguments: argparse.Namespace) -> int:
    return _fetch(station, arguments, DownloadFile(vehicle_ids(arguments.ids), arguments.path))


def _put(station: StationClient, arguments: argparse.Namespace) -> int:
    ids = vehicle_ids(arguments.ids)
    data = read_here(Path(arguments.file), MAX_FILE_BYTES)
    act = f"write {arguments.path} ({len(data)} bytes) on {listed(ids)}"
    return order(station, arguments, WriteFile(ids, arguments.path, data), act)


def _rm(station: StationClient, arguments: argparse.Namespace) -> int:
    ids = vehicle_ids(arguments.ids)
    return order(station, arguments, RemoveFile(ids, arguments.path), f"remove {arguments.path} on {listed(ids)}")


# ---------------------------------------------------------------- logs


def _list_logs(station: StationClient, arguments: argparse.Namespace) -> int:
    ended = station.carry_out(ListLogs(vehicle_ids(arguments.ids)))
    return tell_lines(ended, _log_lines, arguments, "logs")


def _log_lines(one: VehicleOutcome) -> Iterator[str]:
    for log in one.result.logs:
        day = time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(log.time_utc)) if log.time_utc else "time not known"
        yield f"{one.vehicle:>4} log {log.id:>5} {log.size:>12} bytes  {day}"
    if one.ok and not one.result.logs:
        yield f"vehicle {one.vehicle}: no logs"


def _get_log(station: StationClient, arguments: argparse.Namespace) -> int:
    return _fetch(station, arguments, DownloadLog(vehicle_ids(arguments.ids), arguments.log))


def _erase(station: StationClient, arguments: argparse.Namespace) -> int:
    ids = vehicle_ids(arguments.ids)
    return order(station, arguments, EraseLogs(ids), f"erase ALL logs on {listed(ids)}")


# ---------------------------------------------------------------- files here


def _may_copy(arguments: argparse.Namespace) -> bool:
    """Return whether a copy may be put where it is wanted; this is asked before anything is fetched."""
    if arguments.file is None:
        return True
    only_one(arguments.ids, "for one file")
    target = Path(arguments.file)
    if target.is_dir():
        return True
    may_write(target, force=True)
    return not target.exists() or confirmed(f"overwrite {target}", yes=arguments.yes)


def _fetch(station: StationClient, arguments: argparse.Namespace, request: DownloadFile | DownloadLog) -> int:
    """Fetch files, report where the station keeps them, and copy the wanted one to this folder."""
    if not _may_copy(arguments):
        return not_sent(arguments)
    ended = station.carry_out(request)
    try:
        folder = state_dir(station.kind)
    except ConfigError as error:
        raise CommandError(str(error)) from None
    for one in ended:
        if one.ok and one.result.path:
            kept = folder / one.result.path
            one.text = str(kept)
            one.data = {"path": str(kept)}
            if arguments.file is not None:
                _copy(kept, Path(arguments.file), one)
    return tell(ended, arguments)


def _copy(kept: Path, target: Path, one: VehicleOutcome) -> None:
    target = target / kept.name if target.is_dir() else target
    try:
        shutil.copyfile(kept, target)
    except OSError as error:
        one.ok, one.text = False, f"{target}: {error.strerror}; it is kept as {kept}"
    else:
        one.text = str(target)


def read_here(path: Path, max_bytes: int) -> bytes:
    """Return the content of a file of the user's. Raises `CommandError`."""
    try:
        with open_plain(path) as file:
            data = file.read(max_bytes + 1)
    except OSError as error:
        raise CommandError(f"{path}: {error.strerror}") from None
    if len(data) > max_bytes:
        raise CommandError(f"{path}: larger than {max_bytes >> 20} MB")
    return data


def write_here(path: Path, data: bytes, *, yes: bool) -> bool:
    """Write a file of the user's as a whole; return False if the user keeps the file that is there."""
    may_write(path, force=True)
    if path.exists() and not confirmed(f"overwrite {path}", yes=yes):
        return False
    put(path, data, force=True)
    return True
