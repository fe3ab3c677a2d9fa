"""Records a flight as an animated picture, `docs/flight.svg`: take-off and patrol of the shipped scenario, in a loop.

    python docs/make_recording.py

The console runs on a lock-step flight. A row of the screen is drawn once for each time that it stays the same, and CSS
shows it during that time. So the file is a fraction of the pictures that it is made of, and asks nobody for fonts.
"""

import asyncio
import re
import sys
import tempfile
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

import make_pictures

from tui_gcs.app import ConsoleApp
from tui_gcs.cli.common import read_scenario
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.rehearsal.lock_step import LockStep

SIZE = (100, 30)
FRAMES = 30
STEP_S = 5.0
"""Seconds of flight between two frames."""
SHOWN_S = 0.5
"""Seconds that a frame is shown: ten times as fast as the flight."""
STYLE = re.compile(r"\.terminal-\d+-(r\d+) \{ (.*?);? ?\}")
PIECE = re.compile(
    r'<rect fill="([^"]*)" x="[^"]*" y="([\d.]+)"[^>]*/>'
    r'|<text class="terminal-\d+-(r\d+)" x="([\d.]+)" y="([\d.]+)" textLength="([\d.]+)"[^>]*>(.*?)</text>'
)
BACKGROUND = "#101418"
LINE_PX, CELL_PX = 24.4, 12.2
Rows = dict[int, str]
"""What is drawn, by row of the screen."""


def rows_of(svg: str, styles: dict[str, str]) -> Rows:
    """The rows of one picture. `styles` collects the styles of all pictures: names by what they say."""
    meant = dict(STYLE.findall(svg))
    rows: defaultdict[int, list[str]] = defaultdict(list)
    for piece in PIECE.finditer(svg):
        fill, rect_y, name, x, y, length, text = piece.groups()
        if fill == BACKGROUND:
            continue
        if fill is not None:
            rows[round(float(rect_y) / LINE_PX)].append(re.sub(r' shape-rendering="[^"]*"', "", piece[0]))
        elif text.replace("&#160;", " ").strip():
            kept = styles.setdefault(meant[name], f"s{len(styles)}")
            # A width is needed for runs only: fonts differ in theirs.
            width = "" if float(length) <= CELL_PX else f' textLength="{float(length):.1f}"'
            shown = text.replace("&#160;", " ")
            rows[round(float(y) / LINE_PX) - 1].append(
                f'<text class="{kept}" x="{float(x):.1f}" y="{y}"{width}>{shown}</text>'
            )
    return {row: "".join(pieces) for row, pieces in rows.items()}


def runs(frames: list[Rows]) -> dict[tuple[int, int], list[str]]:
    """What is drawn from one frame until before another: by (first, end)."""
    found: defaultdict[tuple[int, int], list[str]] = defaultdict(list)
    for row in sorted({row for frame in frames for row in frame}):
        first = 0
        for number in range(1, len(frames) + 1):
            drawn = frames[first].get(row, "")
            if number == len(frames) or frames[number].get(row, "") != drawn:
                found[first, number].append(drawn)
                first = number
    return found


def animated(frames: list[Rows], styles: Mapping[str, str]) -> str:
    """The picture."""
    width, height = SIZE[0] * CELL_PX, SIZE[1] * LINE_PX + 8
    css = [f".{name} {{ {meaning} }}" for meaning, name in styles.items()]
    groups = []
    for (first, end), drawn in runs(frames).items():
        if (first, end) == (0, len(frames)):
            groups.append(f"<g>{''.join(drawn)}</g>")
            continue
        name, a, b = f"f{first}-{end}", 100 * first / len(frames), 100 * end / len(frames)
        hidden = f"0% {{ visibility: hidden }} {a:.3f}% {{ visibility: visible }} " if first else ""
        css.append(f"@keyframes {name} {{ {hidden}{b:.3f}% {{ visibility: hidden }} }}")
        start = "hidden" if first else "visible"
        css.append(f".{name} {{ visibility: {start}; animation: {name} {len(frames) * SHOWN_S}s step-end infinite }}")
        groups.append(f'<g class="{name}">{"".join(drawn)}</g>')
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" xml:space="preserve">',
            "<style>text { font-family: monospace; font-size: 20px; white-space: pre }",
            *css,
            "</style>",
            f'<rect width="{width:.0f}" height="{height:.0f}" fill="{BACKGROUND}"/>',
            *groups,
            "</svg>",
            "",
        ]
    )


async def record(frames: int, file: str | None = None) -> str:
    """Fly a scenario (None: the shipped one) and record so many frames; the picture."""
    scenario, toml, _ = read_scenario(file)
    styles: dict[str, str] = {}
    recorded = []
    with tempfile.TemporaryDirectory() as logs:
        flight = LockStep(scenario, toml, Path(logs))
        app = ConsoleApp(flight.bus, "you", kind=RunKind.SIM)
        async with app.run_test(size=SIZE) as pilot:
            make_pictures.fly(flight, make_pictures.READY_S)
            start = m.Start(vehicles=tuple(sorted(flight.station.picture.fleet.vehicles)))
            flight.bus.ask(f"gcs/req/{app.feed.requests.principal}", m.encode(start))
            for _ in range(frames):
                make_pictures.fly(flight, STEP_S - 1.0)
                await make_pictures.settle(pilot, flight, app, times=2)
                recorded.append(rows_of(app.export_screenshot(), styles))
        flight.close()
    return animated(recorded, styles)


def main() -> None:
    """Record."""
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else make_pictures.FOLDER / "flight.svg"
    target.write_text(asyncio.run(record(FRAMES)), encoding="utf-8")


if __name__ == "__main__":
    main()
