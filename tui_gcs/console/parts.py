"""What the parts of the console share, and how an operator starts one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from textual.app import App

from tui_gcs.client.user_settings import SettingsInUse
from tui_gcs.console.groups import GroupFile
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.formats.overlays import Overlay
from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.live_watch import LiveWatch
from tui_gcs.feed.notices import Severity
from tui_gcs.widgets.basics.glyphs import GlyphSet

if TYPE_CHECKING:
    from tui_gcs.actions.palette.own_commands import OwnCommands  # imported when first needed
    from tui_gcs.core.formats.base_map_files import BaseMap


class ShowNotice(Protocol):
    """Shows the operator a line for a while; of several with the same `about` the newest counts."""

    def __call__(self, text: str, level: Severity = Severity.NORMAL, about: str = "") -> None:
        """Show the line."""


@dataclass(frozen=True)
class ConsoleParts:
    """What every part of the console works with."""

    app: App[None]
    """Pushes screens and runs workers."""
    feed: Feed
    glyphs: GlyphSet
    clock: Clock
    notice: ShowNotice


@dataclass(frozen=True)
class ConsoleOptions:
    """How the operator wants the console; the defaults are those of tests."""

    replay: bool = False
    """The station replays a recording: nothing can be commanded, and there is no plan."""
    beside: LiveWatch | None = None
    """Beside a replay: the stations that fly meanwhile."""
    read_only: bool = False
    starts_station: bool = False
    """The command line has just started the station."""
    keymap: Mapping[str, str] = field(default_factory=dict)
    """Checked, as `read_keymap` returns it."""
    glyphs: GlyphSet | None = None
    """None: what the terminal can show."""
    overlays: Sequence[Overlay] = ()
    elevation: Elevation | None = None
    """The heights of the ground, where the operator gave a terrain file."""
    base_map: "BaseMap | None" = None
    """The base map, where the operator gave a file."""
    theme: str = ""
    """Name of the theme to begin with, of `THEMES`; empty for the first."""
    own_commands: "OwnCommands | None" = None
    """What the operator can type after `:` beside the names of actions; None: nothing else."""
    settings: SettingsInUse = field(default_factory=SettingsInUse)
    groups: GroupFile | None = None
    """Where the operator's groups of vehicles are kept; None: they are forgotten."""
    folder: Path | None = None
    """Where work in progress is kept; None: nowhere."""
    recordings: Mapping[str, Path] = field(default_factory=dict)
    """The state directories with recorded flights, named LIVE and SIM."""
