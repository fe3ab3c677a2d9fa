"""Attaches a console to a station that runs or is just starting."""

import argparse
import gc
import os
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tui_gcs.cli import console_options
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.files.file_access import base_map_of, elevation_of
from tui_gcs.cli.installation import config
from tui_gcs.client.launcher import START_LIMIT_S, start_error
from tui_gcs.client.user_settings import SettingsInUse, path_of
from tui_gcs.console.groups import GroupFile
from tui_gcs.core.base.clock import MonotonicClock
from tui_gcs.core.base.directories import socket_path, state_dir
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.formats.overlays import Overlay, OverlayError, load_overlay
from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.protocol.zenoh_bus import connect_later
from tui_gcs.terminal.terminal_options import prepare_textual, wants_slow

if TYPE_CHECKING:
    from tui_gcs.actions.palette.own_commands import OwnCommands
    from tui_gcs.app import ConsoleApp
    from tui_gcs.core.formats.base_map_files import BaseMap
    from tui_gcs.feed.live_watch import LiveWatch

POLL_S = 0.2


def read_overlays(files: Sequence[str]) -> tuple[Overlay, ...]:
    """Read the drawings that the operator's files put on the map. Raises `CommandError`."""
    try:
        return tuple(overlay for file in files for overlay in load_overlay(Path(file)))
    except OverlayError as error:
        raise CommandError(f"--overlay {error}") from None


@dataclass(frozen=True)
class ConsolePreferences:
    """The operator's settings for the console: keys, theme, drawings, terrain, base map, read-only, own commands."""

    keymap: Mapping[str, str]
    theme: str
    overlays: tuple[Overlay, ...]
    elevation: Elevation | None
    base_map: "BaseMap | None"
    read_only: bool
    own_commands: "OwnCommands | None"
    settings: SettingsInUse


def preferences(arguments: argparse.Namespace) -> ConsolePreferences:
    """Return the settings of the command line, the environment and the operator's files. Raises `CommandError`."""
    prepare_textual(os.environ)  # before anything imports Textual
    read_only = os.environ.get("TUI_GCS_READ_ONLY", "") not in ("", "0")
    elevation = elevation_of(os.environ.get("TUI_GCS_TERRAIN") or None)
    return ConsolePreferences(
        operators_keymap(),
        operators_theme(),
        read_overlays(arguments.overlay),
        elevation,
        base_map_of(os.environ.get("TUI_GCS_BASE_MAP") or None),
        read_only,
        config.own_commands(os.environ),
        SettingsInUse(path_of(os.environ), arguments.settings),
    )


def recordings() -> dict[str, Path]:
    """Return the folders in which stations of this computer record, by their kind. Raises `ConfigError`."""
    return {str(kind): state_dir(kind) for kind in (RunKind.LIVE, RunKind.SIM)}


def attach(kind: RunKind, wanted: ConsolePreferences, *, starts_station: bool = False) -> int:
    """Show the console until the operator detaches; the station goes on. Raises `CommandError`."""
    gc.disable()  # nothing that an import makes is garbage: looking for it takes a tenth of the first frame's time
    from tui_gcs.app import ConsoleApp
    from tui_gcs.console.parts import ConsoleOptions

    gc.freeze()
    gc.enable()
    bus = connect_later(socket_path(kind))
    over = threading.Event()
    try:
        app = ConsoleApp(
            bus,
            kind=kind,
            options=ConsoleOptions(
                overlays=wanted.overlays,
                elevation=wanted.elevation,
                base_map=wanted.base_map,
                read_only=wanted.read_only,
                starts_station=starts_station,
                keymap=wanted.keymap,
                theme=wanted.theme,
                own_commands=wanted.own_commands,
                settings=wanted.settings,
                groups=GroupFile(state_dir(kind) / "groups.json"),
                folder=state_dir(kind),
                recordings=recordings(),
            ),
        )
        threading.Thread(target=_watch_start, args=(app, kind, over), daemon=True).start()
        app.run(mouse=not wants_slow())  # with a mouse every move of it is sent upstream
        if why := start_error(kind):
            raise CommandError(why)
        sys.stdout.write(_farewell(app, kind))
        return app.return_code or 0
    finally:
        over.set()
        bus.close()


@contextmanager
def stations_beside(program: str) -> Iterator["LiveWatch"]:
    """Listen to the stations of this computer while `program` shows a recording, which may cover their console."""
    from tui_gcs.feed.live_watch import LiveWatch

    buses = {kind: connect_later(socket_path(kind)) for kind in (RunKind.LIVE, RunKind.SIM)}
    try:
        yield LiveWatch(buses, f"{program}-{os.getpid()}", MonotonicClock())
    finally:
        for bus in buses.values():
            bus.close()


def operators_keymap() -> dict[str, str]:
    """Return the operator's own keys; none where there is no keymap file. Raises `CommandError`."""
    from tui_gcs.actions.keymap import KeymapError, default_path, read_keymap

    named = os.environ.get("TUI_GCS_KEYMAP", "")
    path = Path(named) if named else default_path()
    if not named and not path.exists():
        return {}
    from tui_gcs.actions.scopes import SCOPES

    try:
        return read_keymap(path, SCOPES)
    except KeymapError as error:
        raise CommandError(str(error)) from None


def operators_theme() -> str:
    """Return the name of the theme to begin with. Raises `CommandError`."""
    named = os.environ.get("TUI_GCS_THEME", "") or console_options.THEMES[0]
    if named not in console_options.THEMES:
        raise CommandError(f"TUI_GCS_THEME: no theme {named[:20]!r}; there are: {', '.join(console_options.THEMES)}")
    from tui_gcs.terminal.themes import THEMES

    return list(THEMES)[console_options.THEMES.index(named)]


def _watch_start(app: "ConsoleApp", kind: RunKind, over: threading.Event) -> None:
    """End the console if the station reports that it cannot start."""
    for _ in range(int(START_LIMIT_S / POLL_S)):
        if over.wait(POLL_S) or app.feed.status is not None:
            return
        if start_error(kind):
            app.call_from_thread(app.exit, return_code=2)
            return


def _farewell(app: "ConsoleApp", kind: RunKind) -> str:
    status = app.feed.status
    if status is None or app.feed.station_lost:
        return f"detached; no {kind} station was heard: tui-gcs status\n"
    word = f"{status.armed} vehicles armed" if status.armed else "nothing armed"
    return f"detached; the {kind} station goes on ({word}): tui-gcs attach | status | stop\n"
