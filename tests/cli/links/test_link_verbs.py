"""`tui-gcs link` and `tui-gcs forward` on a station on paper, and on a real one with a real partner."""

import socket
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.core.rigs.link_rig import free_port
from tests.core.rigs.service_rig import Peer, ServiceRig
from tests.rigs.captured_command import CapturedCommand
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.links import verbs
from tui_gcs.cli.main import main
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol.bus import BusSession
from tui_gcs.core.protocol.common import EventClass


class Shell(CapturedCommand):
    """Runs a command in this process against a whole station on a virtual clock."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self.rig = ServiceRig(folder, Peer(1)).heard()
        super().__init__(capsys)
        monkeypatch.setattr(verbs, "which", lambda named: RunKind.LIVE)
        monkeypatch.setattr(verbs, "join", lambda kind: BusSession(self.rig.bus))
        monkeypatch.setattr(sys, "stdin", None)  # nothing is asked


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iterator[Shell]:
    shell = Shell(tmp_path, monkeypatch, capsys)
    yield shell
    for link in (*shell.rig.station.comms.links.values(), *(p.link for p in shell.rig.station.comms.forwarder.ports)):
        link.close()


def test_a_link_is_added_rated_listed_and_closed(shell: Shell) -> None:
    name = f"udpin:127.0.0.1:{free_port()}"
    assert shell.run("link", "add", f"{name},secure") == (0, f"link {name} is open (secure, so keys may be sent)\n", "")
    assert shell.run("link", "rate", name, "5000") == (0, f"link {name} at 5000 B/s\n", "")
    code, out, _ = shell.run("link", "list")
    assert code == 0 and out.splitlines()[0].startswith("memory  up  1 vehicles, no limit")
    assert out.splitlines()[1].startswith(f"{name}  up  0 vehicles, 5000 B/s, secure")
    assert shell.run("link", "rate", name, "none")[1] == f"link {name} without a limit\n"
    assert shell.run("link", "close", name) == (0, f"link {name} is closed\n", "")
    texts = [e.source for e in shell.rig.station.records.events.since(0, 2000) if e.cls is EventClass.OPERATOR]
    assert texts == ["cli"] * 4, "each change is journalled"


def test_a_partner_is_added_listed_and_closed(shell: Shell) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        name = f"udpout:127.0.0.1:{other.getsockname()[1]}"
        assert shell.run("forward", "list") == (0, "nothing is forwarded\n", "")
        code, out, _ = shell.run("forward", "add", name, "--commands")
        assert (code, out) == (0, f"{name} hears the vehicles; its commands are judged, and may reach vehicles\n")
        shell.rig.run(1.5)
        assert other.recv(2048)
        code, out, _ = shell.run("forward", "list")
        assert out.startswith(f"{name}  up  commands are judged; 127.0.0.1:{other.getsockname()[1]}")
        assert shell.run("forward", "close", name) == (0, f"{name} does not hear the vehicles any more\n", "")
        _, report = shell.report("forward", "list")
        (row,) = report["data"]["partners"]
        assert (row["endpoint"], row["is_closed"], row["error"]) == (name, True, "closed by cli")


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("link", "add", "nonsense"), "unknown kind"),
        (("link", "close", "udpin:127.0.0.1:9"), "no open link"),
        (("link", "rate", "memory", "5"), "a rate is from 100"),
        (("forward", "add", "udpout:127.0.0.1:0"), "not within 1…65535"),
        (("forward", "add", "udpout:\x1b[31m:1"), "cannot be printed"),
        (("forward", "close", "udpout:127.0.0.1:9"), "nothing is forwarded to udpout:127.0.0.1:9"),
    ],
)
def test_a_refusal_is_one_line_and_exit_code_1(shell: Shell, words: tuple[str, ...], why: str) -> None:
    code, out, err = shell.run(*words)
    assert (code, out) == (1, "") and why in err
    assert err.count("\n") == 1 and "\x1b" not in err
    code, report = shell.report(*words)
    assert (code, report["ok"], report["code"]) == (1, False, "refused")


def test_a_rate_that_is_none_is_said_without_a_station(shell: Shell) -> None:
    code, _, err = shell.run("link", "rate", "memory", "fast")
    assert code == 2 and err == "tui-gcs: 'fast' is no rate: whole bytes per second, or none\n"


def test_without_a_station_it_says_how_to_start_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def nothing_runs(named: str | None) -> RunKind:
        raise CommandError("no station runs: `tui-gcs demo` or `tui-gcs fly` starts one")

    monkeypatch.setattr(verbs, "which", nothing_runs)
    assert main(["forward", "add", "udpout:127.0.0.1:14560"]) == 2
    assert "no station runs" in capsys.readouterr().err
