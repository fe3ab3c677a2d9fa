"""Bad input B.6-88…96: files of vehicles. One test per case of the catalogue."""

import errno
import json
import lzma
import os
import struct
import zlib
from pathlib import Path
from typing import Any

import pytest

from tests.hostile.peer_rig import PeerRig  # also makes the following importable

from tests.core.rigs.ftp_peer import ACK, BURST, NAK, OPEN, READ, FtpServer  # isort: skip
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Peer  # isort: skip

from tui_gcs.core.base.safe_files import FileRefused, PartFile, SafeFolder, safe_name
from tui_gcs.core.services.files import ftp_read
from tui_gcs.core.services.files.ftp_codec import crc32
from tui_gcs.core.services.vehicle import component_metadata as metadata
from tui_gcs.core.uplink.jobs import JobState

FILE = bytes(range(256)) * 40
Request = tuple[int, int, int, int, int, bytes]
"""(seq, session, opcode, size, offset, data)"""


def evil(tmp_path: Path, autopilot: int = ARDUPILOT, files: dict[str, bytes] | None = None, **traits: Any):
    peer = Peer(1, autopilot=autopilot)
    server = FtpServer(peer, files if files is not None else {"/f.bin": FILE}, **traits)
    return PeerRig(tmp_path, peer), server


def written(tmp_path: Path) -> list[str]:
    """Files in the state directory, the caches and logs of tests apart."""
    root = tmp_path / "state" / "files"
    return sorted(str(path.relative_to(root)) for path in root.rglob("*") if path.is_file() or path.is_symlink())


# ---------------------------------------------------------------- 88: names


@pytest.mark.parametrize(
    ("told", "name"),
    [
        ("../../x", "x"),
        ("/etc/passwd", "passwd"),
        ("a\\..\\b", "b"),
        ("%2e%2e%2f", None),
        ("x\0y", None),
        ("y" * 300, None),
        ("CON", None),
        ("con.txt", None),
        ("-rf", None),
        (".hidden", None),
        ("dot.", None),
        ("..", None),
        ("", None),
        ("new\nline", None),
        ("00000001.BIN", "00000001.BIN"),
    ],
)
def test_b6_88_only_harmless_base_names_are_names_here(told: str, name: str | None) -> None:
    assert safe_name(told) == name


def test_b6_88_listings_with_evil_names_are_shown_and_lead_nowhere(tmp_path: Path) -> None:
    names = [
        b"F../../x\t5",
        b"F/etc/passwd\t5",
        b"Fa\\..\\b\t5",
        b"F\x1b]0;x\x07\t5",
        b"FCON\t5",
        b"F-rf\t5",
        b"Fsame\t5",
    ]
    entries = [*names, b"Fsame\t5", b"F" + b"z" * 200, b"D..", b"F\t5", b"Q?", b"Fhuge\t99999999999999999999"]
    rig, _ = evil(tmp_path, listing={"/": entries})
    job = rig.station.services.ftp.list(1, "/")
    rig.until(lambda: job.over, 5.0)
    shown = {entry.name: entry.exact for entry in job.task.entries}
    assert [entry.name for entry in job.task.entries].count("same") == 2
    assert not shown["../../x"] and not shown["a\\..\\b"] and not shown["␛]0;x␇"]
    assert [entry.size for entry in job.task.entries if entry.name == "huge"] == [None]
    rig.holds()


@pytest.mark.parametrize("path", ["/f.bin", "/%2e%2e%2fCON", "/-rf", "/CON"])
def test_b6_88_a_download_stays_below_its_own_folder(tmp_path: Path, path: str) -> None:
    rig, _ = evil(tmp_path, files={path: FILE})
    first, second = (rig.station.services.ftp.download(1, path) for _ in range(2))
    rig.until(lambda: first.over and second.over, 10.0)
    base = path[1:] if path == "/f.bin" else "file"
    again = "f-2.bin" if path == "/f.bin" else "file-2"
    assert written(tmp_path) == sorted([f"vehicle-1/{base}", f"vehicle-1/{again}"])
    assert (tmp_path / "state" / second.path).read_bytes() == FILE
    rig.holds()


# ---------------------------------------------------------------- 89: sizes and offsets


@pytest.mark.parametrize("attack", ["endless", "beyond", "far", "wrap", "dribble", "session"])
def test_b6_89_no_file_grows_beyond_its_cap_nor_has_holes(tmp_path: Path, attack: str, monkeypatch: Any) -> None:
    monkeypatch.setattr(ftp_read, "PROGRESS_PERIOD_S", 3.0)
    rig, server = evil(tmp_path, files={"/f": FILE}, announced=0xFFFFFFFF)
    said: list[int] = [0]

    def answer(server: FtpServer, request: Request) -> bool:
        seq, session, op, _, offset, _ = request
        if op not in (READ, BURST):
            return False
        said[0] += 1

        def packet(number: int, at: int, data: bytes, **more: int) -> None:
            server.send(server.raw(seq + number, ACK, op, data, at & 0xFFFFFFFF, **{"session": session, **more}))

        if attack == "endless":
            for number in range(1, 101 if op == BURST else 2):
                packet(number, offset + (number - 1) * 239, bytes(239), complete=number == 100)
        elif attack == "beyond":
            packet(1, offset + 10**6, bytes(239), complete=1)
        elif attack == "far":
            packet(1, 0xFFFFFFF0, bytes(239), complete=1)
        elif attack == "wrap":
            packet(1, 0xFFFFFFFF, bytes(239), complete=1)
        elif attack == "dribble":
            packet(1, offset, b"x", complete=1)
        else:
            packet(1, offset, bytes(239), session=session ^ 1, complete=1)
        return True

    server.sabotage = answer
    job = rig.station.services.ftp.read(1, "/f", max_bytes=500_000)
    rig.until(lambda: job.over, 100.0)
    assert job.state is JobState.FAILED and job.data == b""
    assert len(job._sink.data) <= 500_000
    if attack == "endless":
        assert job.error == "larger than 500000 bytes: not read on"
    assert said[0] < 3000
    rig.holds()


def test_b6_89_overlapping_bursts_do_not_rewrite_what_is_there(tmp_path: Path) -> None:
    rig, server = evil(tmp_path)

    def answer(server: FtpServer, request: Request) -> bool:
        seq, session, op, _, offset, _ = request
        if op == BURST and offset == 0:
            server.reply_session = session
            server.send(server.raw(seq + 1, ACK, BURST, FILE[:239], 0))
            server.send(server.raw(seq + 2, ACK, BURST, b"?" * 239, 0))
            server.send(server.raw(seq + 3, ACK, BURST, FILE[100:339], 100, complete=1))
            return True
        return False

    server.sabotage = answer
    job = rig.station.services.ftp.read(1, "/f.bin")
    rig.until(lambda: job.over, 10.0)
    assert job.data == FILE
    rig.holds()


# ---------------------------------------------------------------- 90: whose answer


def test_b6_90_answers_of_others_old_sessions_and_wrong_numbers_are_ignored(tmp_path: Path) -> None:
    rig, server = evil(tmp_path)
    honest = server.send

    def with_noise(raw: bytes) -> None:
        seq, session, op, size, answers, _, _, offset = struct.unpack_from("<HBBBBBBI", raw)
        lie = b"\xee" * size
        for wrong in (
            (seq + 7, session, op, size, answers, 0, 0, offset),
            (seq - 3, session, op, size, READ, 0, 0, offset),
            (seq, session ^ 0x55, op, size, BURST, 0, 0, offset),
            (seq, session, 77, size, answers, 0, 0, offset),
            (seq, session, op, 255, 3, 0, 0, offset),
        ):
            if (answers not in (OPEN, 2) and wrong[4] != answers) or wrong[2] == 77:
                honest(struct.pack("<HBBBBBBI", wrong[0] & 0xFFFF, *wrong[1:]) + lie)
        rig.evil.say(
            "FILE_TRANSFER_PROTOCOL",
            target_network=0,
            target_system=250,
            target_component=190,
            payload=list((raw[:12] + lie).ljust(251, b"\0")),
        )
        other = rig.evil.encoder
        rig.evil.encoder = type(other)(1, 42)
        honest(raw[:12] + lie)
        rig.evil.encoder = other
        honest(raw)

    server.send = with_noise
    job = rig.station.services.ftp.read(1, "/f.bin")
    rig.until(lambda: job.over, 20.0)
    assert job.data == FILE, job.error
    rig.holds(counted="file answer for another station")
    assert rig.dropped()["file request from a vehicle"]


def test_b6_90_answers_to_nothing_are_counted(tmp_path: Path) -> None:
    rig, server = evil(tmp_path)
    server.reply_session = 1
    for seq in range(30):
        server.send(server.raw(seq, ACK if seq % 2 else NAK, BURST, bytes(239), seq * 239))
    rig.run(0.2)
    rig.holds(counted="file answer not requested")


# ---------------------------------------------------------------- 91…93: on the disk


def test_b6_91_a_wrong_checksum_keeps_the_file_as_bad(tmp_path: Path) -> None:
    rig, server = evil(tmp_path)
    server.crc = lambda *_: server.ack((crc32(FILE) ^ 1).to_bytes(4, "little"))
    job = rig.station.services.ftp.download(1, "/f.bin")
    rig.until(lambda: job.over, 10.0)
    assert job.state is JobState.FAILED and job.error.startswith("its checksum is wrong")
    assert written(tmp_path) == ["vehicle-1/f.bin.bad"]
    rig.holds()


@pytest.mark.parametrize("planted", ["f.bin.part", "f.bin"])
def test_b6_92_planted_links_are_not_written_through(tmp_path: Path, planted: str) -> None:
    rig, _ = evil(tmp_path)
    folder, victim = tmp_path / "state/files/vehicle-1", tmp_path / "victim"
    folder.mkdir(parents=True, mode=0o700)
    (tmp_path / "state/files").chmod(0o700)
    victim.write_text("mine")
    (folder / planted).symlink_to(victim)
    job = rig.station.services.ftp.download(1, "/f.bin")
    rig.until(lambda: job.over, 10.0)
    assert victim.read_text() == "mine" and (folder / planted).is_symlink()
    if planted == "f.bin":
        assert job.path.endswith("f-2.bin"), "another name is free"
    else:
        assert "a link?" in job.error
    rig.holds()


def test_b6_92_a_folder_that_is_a_link_or_open_to_others_is_refused(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    with pytest.raises(FileRefused, match="a link"):
        SafeFolder(tmp_path / "link")
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    with pytest.raises(FileRefused, match="not ours alone"):
        SafeFolder(tmp_path / "open")


def test_b6_92_hard_links_and_pipes_are_no_parts(tmp_path: Path) -> None:
    with SafeFolder(tmp_path / "d") as folder:
        (tmp_path / "victim").write_text("mine")
        os.link(tmp_path / "victim", tmp_path / "d" / "a.part")
        os.mkfifo(tmp_path / "d" / "b.part")
        for name in ("a", "b"):
            with pytest.raises(FileRefused):
                folder.part(name, resume=True)
        with pytest.raises(FileRefused):
            folder.part("../x")


def test_b6_93_a_full_disk_leaves_nothing_and_alarms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig, _ = evil(tmp_path)
    write = PartFile.write

    def full(part: PartFile, offset: int, data: bytes) -> None:
        if offset > 5000:
            raise OSError(errno.ENOSPC, "No space left on device")
        write(part, offset, data)

    monkeypatch.setattr(PartFile, "write", full)
    job = rig.station.services.ftp.download(1, "/f.bin")
    rig.until(lambda: job.over, 10.0)
    assert written(tmp_path) == []
    assert any("No space left on device" in text for text in rig.texts("vehicle 1"))
    rig.holds()


# ---------------------------------------------------------------- 94…96: metadata


def describing(
    tmp_path: Path, uri: str | bytes, files: dict[str, bytes], kinds: dict[str, Any] | None = None
) -> tuple[PeerRig, FtpServer]:
    """A PX4 whose COMPONENT_METADATA names `uri`."""
    general = {"version": 1, "metadataTypes": [kinds]} if kinds else {}
    rig, server = evil(tmp_path, PX4, {"etc/general.json": json.dumps(general).encode(), **files})

    def command(peer: Peer, fields: dict[str, Any]) -> None:
        if fields["command"] == 512 and fields["param1"] == 397:
            peer.say("COMPONENT_METADATA", time_boot_ms=1, file_crc=1, uri=uri)
        if fields["command"] in (511, 512):
            peer.ack(fields["command"])

    rig.evil.answers["COMMAND_LONG"] = command
    return rig, server


EVIL_URIS = [
    "http://169.254.169.254/latest",
    "https://example.org/general.json.xz",
    "file:///etc/passwd",
    "mftp://../../etc/passwd",
    "mftp://etc/../../passwd",
    "mftp://[;comp=100]etc/general.json",
    "\\\\host\\share",
    "mftp://a b",
    "mftp://",
    "MFTP://etc/general.json",
    "mftp://etc//general.json",
    "mftp://%2e%2e/x",
    "",
]


@pytest.mark.parametrize("uri", EVIL_URIS)
def test_b6_94_addresses_that_are_none_of_the_vehicles_own_files_are_never_fetched(tmp_path: Path, uri: str) -> None:
    rig, server = describing(tmp_path, uri, {})
    rig.run(5.0)
    assert not server.asked, "nothing unasked"
    job = rig.station.services.metadata.fetch(1, metadata.PARAMETERS)
    rig.until(lambda: job.over, 10.0)
    assert job.error == "its address is not one of the vehicle's own files: not fetched"
    assert not server.asked
    rig.holds()


@pytest.mark.parametrize("uri", EVIL_URIS)
def test_b6_94_nor_are_such_addresses_within_the_table(tmp_path: Path, uri: str) -> None:
    rig, server = describing(tmp_path, "mftp://etc/general.json", {}, {"type": 1, "uri": uri, "fileCrc": 1})
    job = rig.station.services.metadata.fetch(1, metadata.PARAMETERS)
    rig.until(lambda: job.over, 10.0)
    assert job.error == "its address is not one of the vehicle's own files: not fetched"
    assert [data for _, op, _, _, data in server.asked if op == OPEN] == [b"etc/general.json"]
    rig.holds()


def bomb_gz() -> bytes:
    made = zlib.compressobj(9, zlib.DEFLATED, 31)
    return b"".join(made.compress(bytes(1 << 20)) for _ in range(30)) + made.flush()


def bomb_xz() -> bytes:
    made = lzma.LZMACompressor(lzma.FORMAT_XZ, preset=1)
    return b"".join(made.compress(bytes(1 << 20)) for _ in range(30)) + made.flush()


@pytest.mark.parametrize("bomb", [bomb_gz, bomb_xz])
def test_b6_95_a_bomb_stops_at_8_mb(tmp_path: Path, bomb: Any) -> None:
    data = bomb()
    assert len(data) < 40_000
    kinds = {"type": 1, "uri": "mftp://etc/p.json.xz", "fileCrc": crc32(data)}
    rig, _ = describing(tmp_path, "mftp://etc/general.json", {"etc/p.json.xz": data}, kinds)
    job = rig.station.services.metadata.fetch(1, metadata.PARAMETERS)
    rig.until(lambda: job.over, 30.0)
    assert job.error == "it unpacks to more than 8 MB" and job.data == b""
    rig.holds()


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (lzma.compress(b"{}" * 1000)[:-20], "it is cut short"),
        (b"\xfd7zXZ\0" + bytes(100), "it cannot be unpacked"),
        (b"\x1f\x8bxxxx", "it cannot be unpacked"),
    ],
)
def test_b6_95_broken_archives_are_reported(data: bytes, why: str) -> None:
    with pytest.raises(metadata.MetadataError, match=why):
        metadata.unpack(data)


def test_b6_91_metadata_with_a_wrong_checksum_is_kept_as_bad_and_not_read(tmp_path: Path) -> None:
    kinds = {"type": 1, "uri": "mftp://etc/p.json", "fileCrc": 0x1234}
    rig, _ = describing(tmp_path, "mftp://etc/general.json", {"etc/p.json": b'{"parameters": []}'}, kinds)
    job = rig.station.services.metadata.fetch(1, metadata.PARAMETERS)
    rig.until(lambda: job.over, 10.0)
    assert job.error == "its checksum is wrong: kept as .bad, not used" and job.data == b""
    assert (tmp_path / "state/cache/meta-1-00001234.bad").read_bytes() == b'{"parameters": []}'
    rig.holds()


@pytest.mark.parametrize("table", [b"[" * 100_000, b'{"metadataTypes": 7}', b"\xff\xfe", b"", b"9" * 5000])
def test_b6_95_a_broken_table_is_reported(tmp_path: Path, table: bytes) -> None:
    rig, server = describing(tmp_path, "mftp://etc/general.json", {})
    server.files["etc/general.json"] = table
    job = rig.station.services.metadata.fetch(1, metadata.PARAMETERS)
    rig.until(lambda: job.over, 10.0)
    assert job.error == "the table of its files cannot be read"
    rig.holds()


def test_b6_96_an_address_of_100_bytes_without_an_end_is_bounded(tmp_path: Path) -> None:
    uri = b"mftp://etc/" + b"x" * 89
    rig, server = describing(tmp_path, uri, {})
    job = rig.station.services.metadata.fetch(1, metadata.PARAMETERS)
    rig.until(lambda: job.over, 10.0)
    assert job.error == "no such file"
    assert [data for _, op, _, _, data in server.asked if op == OPEN] == [uri[7:]]
    rig.holds()
