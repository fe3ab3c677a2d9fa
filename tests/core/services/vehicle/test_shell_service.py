"""The autopilot's command line: one user, cleaned lines, never another device, never unforced while armed."""

import json
from pathlib import Path

import pytest

from tests.core.rigs.service_rig import ARDUPILOT, GCS, PX4, Fields, Peer, ServiceRig
from tui_gcs.core.services.vehicle.shell_service import IDLE_S, MAX_LINES, ShellService


class Nsh(Peer):
    """PX4's shell: echoes, answers in chunks of 70, ends in a prompt."""

    def __init__(self, autopilot: int = PX4) -> None:
        super().__init__(1, autopilot=autopilot)
        self.typed = b""
        self.reply = b"PX4 version: 1.17.0\n"
        self.answers = {"SERIAL_CONTROL": Nsh.serial}

    def serial(self, fields: Fields) -> None:
        self.typed += bytes(fields["data"][: fields["count"]])
        if fields["flags"] & 2 and self.typed.endswith(b"\n"):
            line = self.typed.rsplit(b"\n", 2)[-2]
            self.print((line + b"\n" + self.reply if line else b"\n") + b"pxh> ")

    def print(self, data: bytes, *, device: int = 10, flags: int = 1) -> None:
        for start in range(0, len(data), 70):
            chunk = data[start : start + 70]
            self.say_to_us(
                "SERIAL_CONTROL",
                device=device,
                flags=flags,
                timeout=0,
                baudrate=0,
                count=len(chunk),
                data=list(chunk.ljust(70, b"\0")),
            )


def opened(tmp_path: Path) -> tuple[ServiceRig, Nsh, ShellService]:
    peer = Nsh()
    rig = ServiceRig(tmp_path, peer).heard()
    shell: ShellService = rig.station.services.shell
    assert shell.open(1, "anna") == ""
    rig.run(0.2)
    return rig, peer, shell


def test_a_command_and_its_answer(tmp_path: Path) -> None:
    rig, peer, shell = opened(tmp_path)
    assert shell.type(1, "anna", "ver all") == "" and shell.waits(1)
    rig.run(0.2)
    assert shell.lines(1) == ("", "pxh> ver all", "PX4 version: 1.17.0", "pxh> ")
    assert not shell.waits(1)
    assert peer.typed == b"\nver all\n"
    assert all((f["device"], f["flags"]) == (10, 6) for f in peer.got("SERIAL_CONTROL"))
    actions = [json.loads(line) for line in rig.journal.path.read_text().splitlines()]
    assert [a["action"] for a in actions if "action" in a and "shell" in a["action"]] == [
        "shell: open",
        "shell: ver all",
    ]


def test_long_lines_go_in_chunks_of_70_bytes(tmp_path: Path) -> None:
    rig, peer, shell = opened(tmp_path)
    shell.type(1, "anna", "x" * 200)
    rig.run(0.2)
    assert [f["count"] for f in peer.got("SERIAL_CONTROL")][1:] == [70, 70, 61]
    assert peer.typed == b"\n" + b"x" * 200 + b"\n"


@pytest.mark.parametrize("line", ["x" * 201, "two\nlines", "\x1b[A", "naïve"])
def test_only_plain_single_lines_are_typed(tmp_path: Path, line: str) -> None:
    _, peer, shell = opened(tmp_path)
    assert shell.type(1, "anna", line).startswith("one line of at most")
    assert peer.typed == b"\n"


def test_one_user_per_vehicle(tmp_path: Path) -> None:
    rig, peer, shell = opened(tmp_path)
    assert shell.open(1, "bert") == "anna uses this shell"
    assert shell.type(1, "bert", "reboot") == "this shell is not open"
    shell.close(1, "bert")
    assert shell.user(1) == "anna"
    shell.close(1, "anna")
    rig.run(0.1)
    last = peer.got("SERIAL_CONTROL")[-1]
    assert (last["flags"], last["count"]) == (0, 0)
    assert shell.open(1, "bert") == ""


def test_who_types_nothing_for_ten_minutes_leaves_it(tmp_path: Path) -> None:
    rig, _, shell = opened(tmp_path)
    rig.clock.advance(IDLE_S)
    rig.run(0.5)
    assert shell.user(1) == ""


def test_an_armed_vehicle_is_left_alone_unless_forced(tmp_path: Path) -> None:
    rig, peer, shell = opened(tmp_path)
    peer.armed = True
    rig.run(1.5)
    assert shell.type(1, "anna", "reboot") == "the vehicle is armed"
    assert shell.open(1, "anna") == "the vehicle is armed"
    assert shell.open(1, "anna", force=True) == ""
    assert shell.type(1, "anna", "top once") == ""


def test_ardupilot_has_no_shell_and_no_serial_port_is_ever_opened(tmp_path: Path) -> None:
    """EXCLUSIVE on device 100 is its SERIAL0: the link was dead at once."""
    rig = ServiceRig(tmp_path, Nsh(ARDUPILOT)).heard()
    shell = rig.station.services.shell
    assert shell.open(1, "anna", force=True) == "this autopilot has no shell"
    assert shell.open(7, "anna") == "unknown vehicle"
    rig.run(1.0)
    assert not rig.peers[1].got("SERIAL_CONTROL")


def test_output_is_cleaned_and_bounded(tmp_path: Path) -> None:
    rig, peer, shell = opened(tmp_path)
    peer.print(b"\x1b[K\x1b]52;c;AAAA\x07ok\r\n")
    rig.run(0.1)
    assert shell.lines(1)[-1] == "pxh> ␛]52;c;AAAA␇ok"
    for _ in range(20):
        peer.print(b"spam\n" * 200)
        rig.run(0.06)
    peer.print(b"z" * 70 * 40)
    rig.run(0.1)
    assert len(shell.lines(1)) <= MAX_LINES + 1
    assert all(len(line) <= 200 for line in shell.lines(1))
    assert shell.ignored["shell lines too fast"] > 0


def test_serial_data_that_was_not_requested_is_ignored(tmp_path: Path) -> None:
    rig, peer, shell = opened(tmp_path)
    before = shell.lines(1)
    peer.print(b"from the GPS\n", device=2)
    peer.print(b"no reply\n", flags=0)
    peer.say(
        "SERIAL_CONTROL", device=10, flags=1, timeout=0, baudrate=0, count=4, data=[65] * 70, target_system=GCS - 9
    )
    rig.run(0.1)
    assert shell.lines(1) == before
    assert shell.ignored == {"serial data not requested": 2, "serial data for another station": 1}


def test_a_count_beyond_the_data_is_cut(tmp_path: Path) -> None:
    rig, peer, shell = opened(tmp_path)
    peer.say_to_us("SERIAL_CONTROL", device=10, flags=1, timeout=0, baudrate=0, count=255, data=[65] * 69 + [10])
    rig.run(0.1)
    assert shell.lines(1)[-1] == "pxh> " + "A" * 69
