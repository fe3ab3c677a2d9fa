"""Files from anywhere (docs/threats.md B.6-97): one clear line, quickly, and nothing is changed."""

import io
import json
import os
import re
import time
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tui_gcs
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.main import main
from tui_gcs.cli.vehicle.files import write_here
from tui_gcs.core.formats.bounded import MAX_BYTES
from tui_gcs.core.formats.content import Content, FormatError
from tui_gcs.core.formats.file_types import read_file
from tui_gcs.core.missions.draft_file import DraftFileError
from tui_gcs.core.protocol.common import ScenarioChanged
from tui_gcs.core.scenario.load import parse
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_edits import MissionEdits
from tui_gcs.widgets.missions.mission_files import MissionFile
from tui_gcs.widgets.plan.scenario_editor import ScenarioEditor
from tui_gcs.widgets.plan.scenario_edits import ZoneEdits

ENTITY_BOMB = b'<?xml version="1.0"?><!DOCTYPE k [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><kml>&b;</kml>'
OUTSIDE = b'<?xml version="1.0"?><!DOCTYPE k [<!ENTITY x SYSTEM "file:///etc/passwd">]><kml>&x;</kml>'
POINT = "<Placemark><Point><coordinates>8,47</coordinates></Point></Placemark>"
QUICK_S = 1.0
SCENARIO = (Path(tui_gcs.__file__).parent / "scenarios" / "swarm-challenge.toml").read_text()


def packed(name: str, data: bytes, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", method) as archive:
        archive.writestr(name, data)
    return target.getvalue()


def many_files() -> bytes:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        for number in range(1500):
            archive.writestr(f"{number}.txt", b"")
    return target.getvalue()


HOSTILE: dict[str, tuple[bytes | Callable[[], bytes], str]] = {
    "nothing": (b"", "is empty"),
    "1 GB": (lambda: b"x" * (MAX_BYTES + 1), "larger than 4 MB"),
    "deep": (lambda: b'{"a":' * 100_000, "nested too deeply"),
    "deep list": (lambda: b'{"a":' + b"[" * 100_000, "nested too deeply"),
    "huge number": (b'{"fileType": ' + b"9" * 5000 + b"}", "digits"),
    "NaN": (b'{"fileType": NaN}', "NaN is no number of JSON"),
    "twice": (b'{"a": 1, "a": 2}', "'a' is given twice"),
    "half a character": (b'{"fileType": "\\ud800"}', "half of a character"),
    "UTF-16": ("<kml/>".encode("utf-16"), "UTF-16"),
    "Latin-1": (b"# caf\xe9\nRTL_ALT 1", "line 1: is not UTF-8 text"),
    "binary": (b"\x7fELF\0\0\0", "is not text"),
    "a million items": (
        lambda: b'{"fileType":"Plan","mission":{"items":[' + b"{},".join([b""] * 1_000_000) + b"{}]}}",
        "mission item 1: neither",
    ),
    "entity bomb": (ENTITY_BOMB, "declares a document type or entities"),
    "other files": (OUTSIDE, "declares a document type or entities"),
    "UTF-16 entity": (ENTITY_BOMB.decode().replace("?>", ' encoding="UTF-16"?>', 1).encode("utf-16"), "UTF-16"),
    "deep XML": (lambda: b"<a>" * 100_000, "nested too deeply"),
    "wide XML": (lambda: b"<a>" + b"<b/>" * 200_000, "more than 100000 elements"),
    "torn XML": (b"<kml><Document>", "no element found"),
    "strange XML": (b'<?xml version="1.0" encoding="nonsense"?><kml/>', "unknown encoding"),
    "nested places": (("<Placemark>" * 40 + POINT + "</Placemark>" * 40).encode(), "within a Placemark"),
    "many points": (
        lambda: (
            b"<Placemark><LineString><coordinates>" + b"8,47 " * 100_001 + b"</coordinates></LineString></Placemark>"
        ),
        "more than 100000 points",
    ),
    "zip bomb": (lambda: packed("doc.kml", b" " * 200_000_000), "unpacks to more than 4 MB"),
    "zip of many": (many_files, "more than 1000 files"),
    "zip without": (packed("doc.txt", b"<kml/>"), "an archive without a .kml file"),
    "odd zip": (packed("doc.kml", b"<kml/>", zipfile.ZIP_LZMA), "packed in an unusual way"),
    "torn zip": (packed("doc.kml", b"<kml/>")[:40], "not an archive that can be read"),
    "zip of deep": (lambda: packed("../../doc.kml", b"<a>" * 100_000), "nested too deeply"),
    "a million parameters": (lambda: b"P 1\n" * 1_000_000, "more than 50000 lines"),
    "a million corners": (lambda: b"47.1 8.1\n" * 400_000, "more than 50000 lines"),
    "geo depth": (
        b'{"type":"GeometryCollection","geometries":[' * 40 + b"]}" * 40,
        "nested too deeply",
    ),
    "geo": (b'{"type":"Point","coordinates":[8,147]}', "no place on earth"),
}
"""Contents and what is said of them. Large contents are made by the test that needs them, not by every process."""


@cache
def hostile(name: str) -> tuple[bytes, str]:
    data, why = HOSTILE[name]
    return (data if isinstance(data, bytes) else data()), why


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_wrong_is_one_line_and_changes_nothing(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, why = hostile(name)
    source, target = tmp_path / "in.file", tmp_path / "out.plan"
    source.write_bytes(data)
    begin_s = time.process_time()
    assert main(["convert", str(source), str(target)]) == 2
    assert time.process_time() - begin_s < QUICK_S
    error = capsys.readouterr().err
    assert why in error and error.count("\n") == 1 and "in.file" in error
    assert [path.name for path in tmp_path.iterdir()] == ["in.file"] and source.read_bytes() == data


@pytest.mark.parametrize("name", HOSTILE)
def test_screens_that_open_a_file_say_the_same_and_keep_what_they_have(name: str, tmp_path: Path) -> None:
    data, why = hostile(name)
    source = tmp_path / "in.file"
    source.write_bytes(data)
    missions, zones = MissionEditor(), ScenarioEditor()
    MissionEdits(missions).add()
    zones.station_changed(ScenarioChanged(revision=1, path="", toml=SCENARIO, scenario=parse(SCENARIO, "it")))
    drawn, text = missions.history.draft, zones.text
    begin_s = time.process_time()
    with pytest.raises(DraftFileError, match=re.escape(why)) as caught:
        MissionFile(missions, None).open(source)
    (problem,), done = ZoneEdits(zones).import_zones(source)
    assert time.process_time() - begin_s < 2 * QUICK_S
    assert why in problem and not done
    assert "\n" not in str(caught.value) and "\n" not in problem
    assert (missions.history.draft, zones.text) == (drawn, text)


RING = "[[8,47],[8,48],[9,48],[8,47]]"
CORNERS = ",".join(f"[{8 + i * 1e-5:.5f},{47 + i % 2}]" for i in range(50_000))


@pytest.mark.long
@pytest.mark.parametrize(
    ("areas", "as_fence", "as_zones"),
    [
        ([RING] * 5000, "more than 2000 items", "round 1: more than 64 zones"),
        ([f"[{CORNERS}]"], "more than 2000 items", "an area of 50000 corners: a zone has 1000 at most"),
    ],
)
def test_more_than_a_fence_or_a_round_holds(
    areas: list[str], as_fence: str, as_zones: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The plan screen ran out of names for the areas, and the console ended."""
    source = tmp_path / "in.geojson"
    source.write_text('{"type":"MultiPolygon","coordinates":[' + ",".join(f"[{area}]" for area in areas) + "]}")
    zones = ScenarioEditor()
    zones.station_changed(ScenarioChanged(revision=1, path="", toml=SCENARIO, scenario=parse(SCENARIO, "it")))
    begin_s = time.process_time()
    assert main(["convert", str(source), str(tmp_path / "out.plan")]) == 2
    assert main(["check", str(source)]) == 1
    (problem,), _ = ZoneEdits(zones).import_zones(source)
    assert time.process_time() - begin_s < 3 * QUICK_S
    said = capsys.readouterr()
    assert as_fence in said.err and "at most 2000 are allowed" in said.out
    assert as_zones in problem and zones.text == SCENARIO


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("@include a.parm\n", "line 1: @include a.parm: line 1: @include a.parm: included twice"),
        (
            "@include b.parm\n",
            "line 1: @include b.parm: line 1: @include a.parm: line 1: @include b.parm: included twice",
        ),
        ("@include /etc/passwd\n", "line 1: @include /etc/passwd: only files beside this one are read"),
        ("@include gone.parm\n", "line 1: @include gone.parm: No such file"),
        ("@include pipe\n", "line 1: @include pipe: "),
        ("@include secret\n", "line 1: @include secret: line 1: 3 fields instead of a name and a value"),
        ("".join(f"@include {'./' * n}c.parm\n" for n in range(20)), "more than 16 files"),
    ],
    ids=["itself", "circle", "outside", "gone", "pipe", "no parameters", "many"],
)
def test_what_a_parameter_file_includes_is_bounded(
    text: str, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "a.parm").write_text(text)
    (tmp_path / "b.parm").write_text("@include a.parm\n")
    (tmp_path / "c.parm").write_text("C 1\n")
    (tmp_path / "secret").write_text("a word hidden\n")
    begin_s = time.process_time()
    assert main(["check", str(tmp_path / "a.parm")]) == 2
    error = capsys.readouterr().err
    assert why in error and error.count("\n") == 1 and "hidden" not in error
    assert time.process_time() - begin_s < QUICK_S


def test_a_pipe_is_no_file_to_wait_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "a.plan")
    assert main(["convert", str(tmp_path / "a.plan"), str(tmp_path / "b.kml")]) == 2
    assert "not a file" in capsys.readouterr().err


@pytest.mark.parametrize("what", ["pipe", "folder", "device"])
@pytest.mark.parametrize(
    "command",
    [
        "run IN.toml --link udpin:127.0.0.1:14999 --yes",
        "rehearse IN.toml",
        "rehearse --planner IN.py",
        "demo --headless --scenario IN.toml",
        "sim IN.toml --target 127.0.0.1:14999",
        "replay IN.tlog --summary",
        "convert IN.toml out.kml",
        "convert good.kml out.toml --base IN.toml",
        "check IN.toml",
        "check IN.plan",
        "check IN.param",
        "planner check IN.py",
    ],
)
def test_what_is_no_file_is_refused_at_once_wherever_one_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str, what: str
) -> None:
    """A pipe was waited for without a word, by everything that reads a scenario, a recording or a planner."""
    monkeypatch.chdir(tmp_path)
    name = next(word for word in command.split() if word.startswith("IN"))
    if what == "pipe":
        os.mkfifo(name)
    elif what == "folder":
        Path(name).mkdir()
    else:
        Path(name).symlink_to("/dev/zero")
    Path("good.kml").write_text(f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{POINT}</Document></kml>')
    assert main(command.split()) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert Path(name).stem in line or "zero" in line


@pytest.mark.parametrize("option", ["rehearse --output", "rehearse --report", "demo --headless --output"])
def test_a_result_is_not_written_into_a_pipe_without_a_reader(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str
) -> None:
    os.mkfifo(tmp_path / "out")
    assert main([*option.split(), str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("out: cannot be written (a pipe without a reader)")


def test_a_document_is_not_written_into_a_pipe_without_a_reader(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    os.mkfifo(tmp_path / "out")
    assert main(["hold", "--output", str(tmp_path / "out")]) == 2
    why, where = capsys.readouterr().err.splitlines()
    assert "no station runs" in why and "out: cannot be written (a pipe without a reader)" in where


def test_what_is_wanted_from_a_vehicle_replaces_plain_files_only(tmp_path: Path) -> None:
    """`params save 3 /dev/null --yes` would have put a file in the place of the device."""
    for name in ("pipe", "folder", "link"):
        target = tmp_path / name
        {"pipe": os.mkfifo, "folder": Path.mkdir, "link": lambda path: path.symlink_to("/dev/null")}[name](target)  # type: ignore[operator]
        with pytest.raises(CommandError, match="not a plain file"):
            write_here(target, b"x", yes=True)
    assert write_here(tmp_path / "new", b"x", yes=True) and (tmp_path / "new").read_bytes() == b"x"


def test_no_text_of_a_file_reaches_the_terminal_as_control_codes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    evil = "<Placemark><name>\x9b31m</name><LineString><coordinates>8,47 9,47</coordinates></LineString></Placemark>"
    (tmp_path / "a.kml").write_text(f"<kml>{evil}</kml>")
    main(["convert", str(tmp_path / "a.kml"), str(tmp_path / "b.plan")])
    out = capsys.readouterr()
    assert "does not say how high" in out.err and "\x9b" not in out.err + out.out


PLAN: dict[str, Any] = {
    "fileType": "Plan", "version": 1,
    "mission": {"version": 2, "plannedHomePosition": [47.3, 8.5, 488], "items": [
        {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, None, 47.3, 8.5, 20]},
        {"type": "SimpleItem", "command": 177, "frame": 2, "autoContinue": True, "params": [1, 2, 0, 0, 0, 0, 0]},
    ]},
    "geoFence": {"version": 2, "circles": [], "polygons": [{"polygon": [[47, 8], [47, 9], [48, 9]]}]},
    "rallyPoints": {"version": 2, "points": [[47.397, 8.545, 50]]},
}  # fmt: skip
SEEDS = (
    json.dumps(PLAN).encode(),
    f"<kml>{POINT}</kml>".encode(),
    b'{"type":"Feature","geometry":{"type":"Polygon","coordinates":[[[8,47],[8,48],[9,48],[8,47]]]},"properties":{}}',
    b"QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47\t8\t488\t1\n1\t0\t3\t22\t0\t0\t0\t0\t47\t8\t15\t1\n",
    b"RALLY 47 8 20 0 0 0\n",
    b"1\t1\tRTL_ALT\t3000\t6\n",
    packed("doc.kml", b"<kml/>"),
)


@settings(max_examples=120, deadline=None)
@given(
    st.sampled_from(SEEDS),
    st.lists(st.tuples(st.integers(0, 4000), st.binary(max_size=4), st.integers(0, 30)), max_size=4),
)
def test_a_damaged_file_is_read_or_refused_in_one_line(seed: bytes, damage: list[tuple[int, bytes, int]]) -> None:
    for at, new, gone in damage:
        at %= len(seed) + 1
        seed = seed[:at] + new + seed[at + gone :]
    try:
        assert isinstance(read_file(seed), Content)
    except FormatError as error:
        assert str(error).isprintable() and len(str(error)) < 400
