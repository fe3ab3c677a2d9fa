"""`tui-gcs keys …`: what it keeps, what it asks, and that it never shows a key."""

import argparse
import io
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.rigs.console_pty import PtyConsole
from tui_gcs.cli import keys
from tui_gcs.cli import station_control as control
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.main import main
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.mavlink.signing import SigningKey
from tui_gcs.core.protocol.bus import BusError
from tui_gcs.core.protocol.common import ProvisionKey, Reply, decode_request, encode
from tui_gcs.core.signing.key_derivation import secret_from
from tui_gcs.core.signing.keystore import open_store

CANARY = bytes.fromhex("ca9a4ec0de" * 6 + "ca9a")
PASSPHRASE = "correct horse battery"


@pytest.fixture(autouse=True)
def own_directories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))


class Typist(io.StringIO):
    """stdin with these lines in it."""

    def __init__(self, text: str, *, terminal: bool) -> None:
        super().__init__(text)
        self.terminal = terminal

    def isatty(self) -> bool:
        return self.terminal


class Shell:
    """Runs commands in this process, and looks at everything they say."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self._monkeypatch = monkeypatch
        self._capsys = capsys
        self.said = ""

    def run(self, *arguments: str, types: str = "", terminal: bool = False) -> tuple[int, str]:
        """Exit code, and what was said on both streams."""
        self._monkeypatch.setattr(sys, "stdin", Typist(types, terminal=terminal))
        self._monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal, raising=False)
        code = main(["keys", *arguments])
        out, err = self._capsys.readouterr()
        self.said += out + err
        assert "Traceback" not in err
        assert len(err.splitlines()) <= 1
        return code, out + err


@pytest.fixture
def shell(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Shell:
    return Shell(monkeypatch, capsys)


def test_a_random_key_is_kept_and_only_its_fingerprint_shown(shell: Shell) -> None:
    assert shell.run("add", "north")[0] == 0
    assert shell.run("add", "south", "--vehicle", "3", "--network", "coast")[0] == 0
    north, south = open_store(RunKind.LIVE).keys
    assert north.secret != south.secret
    _, listed = shell.run("list")
    assert listed.splitlines() == [
        f"north  {north.fingerprint}  no vehicle",
        f"south  {south.fingerprint}  vehicle coast/3",
    ]
    for key in (north, south):
        assert key.secret.hex()[:8] not in shell.said


@pytest.mark.parametrize("form", ["hex", "mavproxy", "missionplanner", "qgc"])
def test_a_key_from_stdin(shell: Shell, form: str) -> None:
    text = CANARY.hex() if form == "hex" else PASSPHRASE
    assert shell.run("import", "theirs", "--as", form, "--vehicle", "7", types=f"{text}\r\n")[0] == 0
    assert open_store(RunKind.LIVE).key_of("", 7) == SigningKey("theirs", secret_from(text, form))  # type: ignore[arg-type]
    assert text not in shell.said


def test_hex_that_is_none_is_refused_and_not_repeated(shell: Shell) -> None:
    for text in ("", CANARY.hex()[:-1], CANARY.hex() + "00", "g" * 64):
        code, said = shell.run("add", "north", "--hex", types=text)
        assert code == 2
        assert "64 hex digits" in said or "nothing was given" in said
    assert CANARY.hex()[:12] not in shell.said
    assert open_store(RunKind.LIVE).keys == []
    assert shell.run("add", "north", "--hex", types=CANARY.hex())[0] == 0
    assert open_store(RunKind.LIVE).key("north").secret == CANARY


def test_a_vehicle_that_cannot_be_is_told_before_anything_is_kept(shell: Shell) -> None:
    assert shell.run("add", "north", "--vehicle", "256")[0] == 2
    assert shell.run("add", "north", "--vehicle", "1", "--network", "NORTH/1")[0] == 2
    assert open_store(RunKind.LIVE).keys == []


def test_sim_and_live_keys_are_apart(shell: Shell) -> None:
    assert shell.run("add", "practice", "--kind", "sim")[0] == 0
    assert "no keys" in shell.run("list")[1]
    assert "practice" in shell.run("list", "--kind", "sim")[1]


def test_assign_and_unassign(shell: Shell) -> None:
    shell.run("add", "north")
    assert shell.run("assign", "north", "--vehicle", "4")[0] == 0
    assert open_store(RunKind.LIVE).vehicles_of("north") == [("", 4)]
    assert shell.run("unassign", "--vehicle", "4")[0] == 0
    assert open_store(RunKind.LIVE).vehicles_of("north") == []
    assert "no key named 'south'" in shell.run("assign", "south", "--vehicle", "4")[1]


@pytest.mark.parametrize("typed", ["", "yes\n", "North\n"])
def test_a_key_is_not_removed_by_accident(shell: Shell, typed: str) -> None:
    shell.run("add", "north", "--vehicle", "4")
    code, said = shell.run("remove", "north", types=typed)
    assert code == 1
    assert "nothing was removed" in said
    assert "obey no station without it: 4" in said
    assert len(open_store(RunKind.LIVE).keys) == 1


def test_a_key_is_removed_by_its_name(shell: Shell) -> None:
    shell.run("add", "north")
    assert shell.run("remove", "north", types="north\n")[0] == 0
    assert open_store(RunKind.LIVE).keys == []


def test_a_store_that_others_can_read_is_one_line(shell: Shell, tmp_path: Path) -> None:
    shell.run("add", "north", "--hex", types=CANARY.hex())
    (tmp_path / "state/live/keys/keys.json").chmod(0o644)
    for arguments in (("list",), ("add", "south"), ("provision", "1", "north")):
        code, said = shell.run(*arguments)
        assert code == 2
        assert "open to others" in said
    assert CANARY.hex()[:12] not in shell.said


def test_a_passphrase_is_typed_twice_and_never_echoed() -> None:
    for second, code in ((b"something else", 2), (PASSPHRASE.encode(), 0)):
        console = PtyConsole(["keys", "import", "north", "--as", "mavproxy"])
        assert console.wait_for(b"Passphrase: ", 20)
        console.press(PASSPHRASE.encode() + b"\n")
        assert console.wait_for(b"again: ", 20)
        console.press(second + b"\n")
        assert console.wait_exit(20) == code
        assert PASSPHRASE.encode() not in console.output
        assert b"Traceback" not in console.output
    assert open_store(RunKind.LIVE).key("north").secret == secret_from(PASSPHRASE, "mavproxy")


# Giving a vehicle its key


class Station:
    """The station's end of the bus: first tells a code, then wants it."""

    def __init__(self, *, ok: bool = True) -> None:
        self.asked: list[tuple[str, ProvisionKey]] = []
        self.closed = False
        self.ok = ok

    def ask(self, key: str, payload: bytes, timeout_s: float = 2.0) -> bytes:
        request = decode_request(payload)
        assert isinstance(request, ProvisionKey)
        self.asked.append((key, request))
        if not self.ok:
            return encode(Reply(ok=False, text="vehicle 3 is armed"))
        if not request.confirm:
            return encode(Reply(ok=True, text="vehicle 3 will obey key north (fingerprint) only. Code: K7M2Q9"))
        good = request.confirm == "K7M2Q9"
        return encode(Reply(ok=good, text="sent" if good else "wrong code: nothing was sent"))

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def station(monkeypatch: pytest.MonkeyPatch) -> Station:
    made = Station()
    monkeypatch.setattr(keys, "running", lambda _: True)
    monkeypatch.setattr(keys, "join", lambda _: made)
    return made


@pytest.mark.parametrize(
    ("typed", "code", "said", "confirms"),
    [
        ("K7M2Q9\n", 0, "sent", ["", "K7M2Q9"]),
        ("  K7M2Q9 \n", 0, "sent", ["", "K7M2Q9"]),
        ("K7M2Q8\n", 1, "wrong code", ["", "K7M2Q8"]),
        ("\n", 1, "nothing was sent", [""]),
        ("", 1, "nothing was sent", [""]),
    ],
)
def test_provisioning_takes_two_steps(
    shell: Shell, station: Station, typed: str, code: int, said: str, confirms: list[str]
) -> None:
    shell.run("add", "north")
    got = shell.run("provision", "3", "north", types=typed, terminal=True)
    assert got[0] == code
    assert "Code: K7M2Q9" in got[1]
    assert said in got[1]
    assert [request for _, request in station.asked] == [
        ProvisionKey(vehicle=3, key="north", confirm=confirm) for confirm in confirms
    ]
    assert {key for key, _ in station.asked} == {"gcs/req/cli"}
    assert station.closed
    assert open_store(RunKind.LIVE).key("north").secret.hex()[:8] not in shell.said


def test_a_refusal_ends_it(shell: Shell, station: Station) -> None:
    shell.run("add", "north")
    station.ok = False
    code, said = shell.run("provision", "3", "north", types="K7M2Q9\n", terminal=True)
    assert (code, len(station.asked)) == (1, 1)
    assert "vehicle 3 is armed" in said


def test_a_station_that_does_not_answer_is_one_line(
    shell: Shell, station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    def silent(*_: object, **__: object) -> bytes:
        raise BusError("no answer within 5 s")

    monkeypatch.setattr(station, "ask", silent)
    shell.run("add", "north")
    assert shell.run("provision", "3", "north", terminal=True) == (2, "tui-gcs: no answer within 5 s\n")
    assert station.closed


def test_never_from_a_script_without_a_key_or_without_a_station(shell: Shell, station: Station) -> None:
    assert "no key named 'north'" in shell.run("provision", "3", "north", terminal=True)[1]
    shell.run("add", "north")
    code, said = shell.run("provision", "3", "north", types="K7M2Q9\n", terminal=False)
    assert code == 2
    assert "terminal" in said
    assert station.asked == []


def test_provisioning_needs_a_running_station(shell: Shell) -> None:
    shell.run("add", "north")
    code, said = shell.run("provision", "3", "north", terminal=True)
    assert code == 2
    assert "no LIVE station runs" in said


def test_the_key_of_a_vehicle_that_flies_is_not_taken_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without its key it would obey nobody, stops included."""
    frame = SimpleNamespace(rows=lambda: [SimpleNamespace(id=2, armed=True), SimpleNamespace(id=3, armed=False)])
    monkeypatch.setattr(keys, "running", lambda kind: True)
    monkeypatch.setattr(control, "newest", lambda kind: (None, frame))
    live = argparse.Namespace(kind="live")
    with pytest.raises(CommandError, match="vehicle 2 is armed"):
        keys._not_in_flight(live, [("", 2), ("", 3)])
    keys._not_in_flight(live, [("", 3)])
