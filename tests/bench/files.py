"""How soon a broken or hostile file is refused: whole commands, each a process of its own, as a person starts them.

Beside the seconds stands how many times a Python that does nothing they are: on a slow machine both grow.
"""

import io
import json
import os
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

from tests.bench.headless import COMMAND
from tests.bench.row import NotMeasured, Row

LIMIT_S = 1.0
"""As docs/threats.md B.6-97 demands: on an idle machine."""
LIMIT_STARTS = 50.0
TIMES = 3
MOST = 4 << 20
SCENARIO = Path(__file__).parents[2] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"
WPL_LINE = "{}\t0\t3\t16\t0\t0\t0\t0\t47.{:07d}\t8.5\t20\t1\n"


def broken_files() -> dict[str, bytes]:
    """Of every kind: cut off, binary, deep, huge with the mistake at its end, or areas that take long to judge."""
    item = {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, None, 47.3, 8.5, 20]}
    plan = {"fileType": "Plan", "version": 1, "mission": {"plannedHomePosition": [47, 8, 0], "items": [item] * 20_000}}
    comb = [[8 + i * 1e-5, 47 + (i % 2) * 0.01] for i in range(50_000)]
    ring = " ".join(f"{lon:.6f},{lat:.6f}" for lon, lat in comb)
    area = json.dumps({"type": "Polygon", "coordinates": [[*comb, comb[0]]]}).encode()
    kml = f"<kml><Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>{ring}".encode()
    closed = b"</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></kml>"
    small = b"<Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>8,47 8,48 9,48 8.5,47.5"
    areas = b"<kml>" + (small + closed[: -len(b"</kml>")]) * 14_000
    scenario = SCENARIO.read_bytes()
    zone = '[[round.zone]]\nname = "z{0}"\nrole = "no-fly"\nshape = "polygon"\nvertices_m = [{1}]\n\n'
    star = ", ".join(f"[{i}, {(i * 37) % 101}]" for i in range(200))
    zones = "".join(zone.format(i, star) for i in range(60)).encode()
    wpl = "QGC WPL 110\n" + "".join(WPL_LINE.format(i, i) for i in range(90_000))
    row = [16, 3, [0, 0, 0, None], 473_000_000, 85_000_000, 20.0, True]
    drawn = {str(i): {"mission": [row] * 2000} for i in range(1, 200)} | {"200": {"mission": [row] * 2001}}
    missions = json.dumps({"missions": 1, "vehicles": drawn})
    cut = json.dumps(plan).encode()
    return {
        "cut.plan": cut[: len(cut) // 2],
        "huge.plan": json.dumps({**plan, "mission": {**plan["mission"], "items": [item] * 30_000 + [{}]}}).encode(),  # type: ignore[dict-item]
        "deep.plan": b'{"a":' * 500_000,
        "lists.plan": b"[" * MOST,
        "binary.plan": os.urandom(MOST),
        "cut.waypoints": wpl[: len(wpl) // 2].encode(),
        "huge.waypoints": wpl[: MOST - 100].encode(),
        "binary.waypoints": b"QGC WPL 110\n" + os.urandom(1000),
        "huge.fence": b"47.1 8.1\n" * 400_000 + b"47.1\n",
        "huge.rally": b"RALLY 47.1 8.1 20 0 0 0\n" * 170_000 + b"RALLY 1\n",
        "cut.kml": kml,
        "huge.kml": kml + closed,
        "areas.kml": areas + b"</kml>",
        "deep.kml": b"<a>" * (MOST // 3),
        "bomb.kml": b'<!DOCTYPE k [<!ENTITY a "aaaaaaaaaa">]><kml>&a;</kml>',
        "cut.kmz": _packed(kml + closed)[:3000],
        "huge.kmz": _packed(kml + closed),
        "bomb.kmz": _packed(b" " * 200_000_000),
        "cut.geojson": area[: len(area) // 2],
        "huge.geojson": area,
        "deep.geojson": b'{"type":"GeometryCollection","geometries":[' * 90_000,
        "huge.param": b"".join(b"P%d,1\n" % i for i in range(400_000)) + b"X\n",
        "cut.params": b"".join(b"1\t1\tP%d\t1\t9\n" % i for i in range(250_000)) + b"1\t1",
        "huge.parm": b"P 1\n" * 1_000_000,
        "cut.json": missions[: len(missions) // 2].encode(),
        "huge.json": missions.encode(),
        "cut.toml": scenario[: len(scenario) // 2],
        "keys.toml": b"".join(b"a%d = 1\n" % i for i in range(25_000)),
        "zones.toml": scenario.replace(b"[[round.zone]]", zones + b"[[round.zone]]", 1),
        "deep.toml": b"a = " + b"[" * 1000 + b"\n" + b"a." * 400 + b"b = 1\n",
        "huge.toml": b"a = 1\n" * 1_000_000,
        "binary.toml": os.urandom(100_000),
    }


def _packed(data: bytes) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("doc.kml", data)
    return target.getvalue()


def files(folder: Path) -> Iterator[Row]:
    """The soonest of three starts of each, for other work only delays it; the slowest named first."""
    bare_s = min(_seconds([sys.executable, "-c", "pass"])[0] for _ in range(9))
    yield Row("a Python that does nothing", bare_s * 1000.0, "ms")
    took: dict[str, float] = {}
    for name, data in broken_files().items():
        file = folder / name
        file.write_bytes(data)
        for command in (["check", str(file)], ["convert", str(file), str(folder / "out.plan")]):
            runs = [_seconds([*COMMAND, *command]) for _ in range(TIMES)]
            if any(code not in (1, 2) for _, code in runs):
                raise NotMeasured(f"{command[0]} {name} ended with {[code for _, code in runs]}")
            (folder / "out.plan").unlink(missing_ok=True)
            took[f"{command[0]} {name}"] = min(seconds for seconds, _ in runs)
    for what, seconds in sorted(took.items(), key=lambda each: -each[1]):
        yield Row(f"refused: {what}", seconds, "s", LIMIT_S)
    yield Row("the slowest of them, in starts of Python", max(took.values()) / bare_s, "x", LIMIT_STARTS)


def _seconds(command: list[str]) -> tuple[float, int]:
    begin_s = time.perf_counter()
    done = subprocess.run(command, capture_output=True, check=False)
    return time.perf_counter() - begin_s, done.returncode
