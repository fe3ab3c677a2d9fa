"""The launcher's input, and its loop over real sockets."""

import json
import os
import select
import socket
import subprocess
import sys

import pytest

from sitl.launch.process import LaunchError, parse_target
from sitl.launch.simulated import load_spec, main
from sitl.links.wire import Encoder, cut

SPEC = {"seed": 1, "vehicles": [{"system_id": 3, "lat_deg": 52.0, "lon_deg": -0.6, "ground_amsl_m": 110.0}]}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (None, "No such file"),
        ("{", "not JSON"),
        ("[]", "spec"),
        ('{"seed": 1}', "vehicles is missing"),
        ('{"vehicles": [{"system_id": 1}]}', "lat_deg is missing"),
        ('{"vehicles": []}', "at least one"),
        ('{"vehicles": [], "wind_m_s": [1]}', "not enough values"),
        ('{"vehicles": [], "gps_noise_m": -1}', "gps_noise_m not negative"),
    ],
)
def test_a_bad_spec_is_one_clear_line(tmp_path, capsys, text, problem):
    path = tmp_path / "spec.json"
    if text is not None:
        path.write_text(text)
    assert main(["--spec", str(path), "--target", "127.0.0.1:14550"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert problem in error


def test_a_spec_names_autopilots(tmp_path):
    path = tmp_path / "spec.json"
    place = {"lat_deg": 1.0, "lon_deg": 2.0, "ground_amsl_m": 3.0}
    px4 = place | {"system_id": 2, "autopilot": "px4", "sitl_rates": True}
    path.write_text(json.dumps({"vehicles": [place | {"system_id": 1}, px4]}))
    specs = load_spec(path, 3.0).specs
    assert [(s.autopilot, s.sitl_rates) for s in specs] == [("ardupilot", False), ("px4", True)]
    path.write_text(json.dumps({"vehicles": [px4 | {"autopilot": "betaflight"}]}))
    with pytest.raises(LaunchError, match="autopilot must be one of ardupilot, px4"):
        load_spec(path, 3.0)


@pytest.mark.parametrize("text", ["14550", "host:", ":14550", "host:0", "host:70000", "host:x"])
def test_a_bad_target_is_refused(text):
    with pytest.raises(LaunchError, match="HOST:PORT"):
        parse_target(text)


@pytest.mark.process
def test_vehicles_speak_and_answer_over_udp_and_end_cleanly(tmp_path):
    path = tmp_path / "spec.json"
    path.write_text(json.dumps(SPEC))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
        station.bind(("127.0.0.1", 0))
        station.settimeout(20.0)
        target = f"127.0.0.1:{station.getsockname()[1]}"
        command = [
            sys.executable,
            "-m",
            "sitl.launch.simulated",
            "--spec",
            str(path),
            "--target",
            target,
            "--speed",
            "5",
        ]
        process = subprocess.Popen([*command, "--parent", str(os.getpid())])
        try:
            heard = _until(station, "HEARTBEAT")
            assert heard.system == 3
            station.sendto(Encoder(255, 190).frame("COMMAND_LONG", {"target_system": 3, "command": 401}), heard.address)
            assert _until(station, "COMMAND_ACK").fields["command"] == 401
        finally:
            process.terminate()
        assert process.wait(20.0) == 0


class _Heard:
    def __init__(self, frame, address):
        self.system, self.fields, self.address = frame.system, frame.fields, address


def _until(station, name):
    while True:
        data, address = station.recvfrom(2048)
        for frame in cut(data):
            if frame.name == name:
                return _Heard(frame, address)


@pytest.mark.process
def test_it_ends_when_its_parent_is_gone(tmp_path):
    path = tmp_path / "spec.json"
    path.write_text(json.dumps(SPEC))
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    command = [sys.executable, "-m", "sitl.launch.simulated", "--spec", str(path), "--target", "127.0.0.1:9"]
    done = subprocess.run([*command, "--parent", str(gone.pid)], timeout=20.0, check=False)
    assert done.returncode == 0


@pytest.mark.process
def test_it_ends_when_its_parent_was_killed_and_nobody_has_waited_for_that(tmp_path):
    """A killed process keeps its number until somebody asks how it ended: vehicles flew for it for ever."""
    path = tmp_path / "spec.json"
    path.write_text(json.dumps(SPEC))
    lives, says = os.pipe()
    begin = "import subprocess, sys; subprocess.Popen(sys.argv[2:] + ['--parent', str(__import__('os').getpid())],"
    begin += " pass_fds=[int(sys.argv[1])]); print(flush=True); input()"
    launch = [sys.executable, "-m", "sitl.launch.simulated", "--spec", str(path), "--target", "127.0.0.1:9"]
    parent = subprocess.Popen(
        [sys.executable, "-c", begin, str(says), *launch],
        pass_fds=[says],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    os.close(says)
    try:
        parent.stdout.readline()
        parent.kill()
        assert select.select([lives], [], [], 20.0)[0], "it runs on"
    finally:
        os.close(lives)
        parent.communicate()


@pytest.mark.process
def test_it_ends_when_nobody_holds_the_other_end_of_its_pipe(tmp_path):
    path = tmp_path / "spec.json"
    path.write_text(json.dumps(SPEC))
    wanted, wants = os.pipe()
    command = [sys.executable, "-m", "sitl.launch.simulated", "--spec", str(path), "--target", "127.0.0.1:9"]
    process = subprocess.Popen([*command, "--lifeline", str(wanted)], pass_fds=[wanted])
    os.close(wanted)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(1.5)
    os.close(wants)
    assert process.wait(20.0) == 0


def test_a_pipe_that_is_not_there_is_told(tmp_path, capsys):
    path = tmp_path / "spec.json"
    path.write_text(json.dumps(SPEC))
    assert main(["--spec", str(path), "--target", "127.0.0.1:9", "--lifeline", "999"]) == 2
    assert capsys.readouterr().err == "sitl: --lifeline 999: no pipe is open under this number\n"
