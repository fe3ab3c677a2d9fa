"""The options of every command that shows a console. It imports nothing heavy.

They are handed on as environment variables, which a user may also set for good.
"""

import argparse
from collections.abc import MutableMapping

from tui_gcs.cli import options
from tui_gcs.client.user_settings import THEMES as THEMES


def add(parser: argparse.ArgumentParser) -> None:
    """Add the options to a command's parser."""
    known = "for thin links: one picture a second, 16 colours, no mouse (also: TUI_GCS_SLOW=1)"
    parser.add_argument("--slow", action="store_true", help=known)
    known = (
        "stock Textual, without its private parts: more bytes, and it waits for the terminal (also: TUI_GCS_PLAIN=1)"
    )
    parser.add_argument("--plain", action="store_true", help=known)
    known = "colours to begin with; T changes them (also: TUI_GCS_THEME)"
    parser.add_argument("--theme", choices=THEMES, help=known)
    known = "draw points, lines and areas of a .geojson or .kml file on the map; may be repeated"
    options.repeated(parser, "--overlay", "FILE", known)
    known = "heights of the ground: an SRTM tile (.hgt), a folder of them, or an .asc grid (also: TUI_GCS_TERRAIN)"
    parser.add_argument("--terrain", metavar="PATH", help=known)
    known = "water, roads, buildings under the map: .pmtiles or .mbtiles of vector tiles (also: TUI_GCS_BASE_MAP)"
    parser.add_argument("--base-map", metavar="FILE", help=known)
    known = "look only: this console commands nothing (also: TUI_GCS_READ_ONLY=1)"
    parser.add_argument("--read-only", action="store_true", help=known)
    known = "your own keys, TOML (default: tui-gcs/keymap.toml where configurations are; also: TUI_GCS_KEYMAP)"
    parser.add_argument("--keymap", metavar="FILE", help=known)


def apply(arguments: argparse.Namespace, environ: MutableMapping[str, str]) -> None:
    """Put the options of a command with a console into the environment, where they were given."""
    if not hasattr(arguments, "slow"):
        return
    for name, variable in (("slow", "TUI_GCS_SLOW"), ("plain", "TUI_GCS_PLAIN"), ("read_only", "TUI_GCS_READ_ONLY")):
        if getattr(arguments, name, False):
            environ[variable] = "1"
    for name in ("keymap", "theme", "terrain", "base_map"):
        if value := getattr(arguments, name, None):
            environ[f"TUI_GCS_{name.upper()}"] = value
