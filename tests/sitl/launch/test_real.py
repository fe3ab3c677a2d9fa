"""How real autopilots are started, watched and ended; the programs here only write down how they were called."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sitl.launch.process import LaunchError
from sitl.launch.real import Options, StartPlace, arducopter, find, main, px4

PLACE = StartPlace(3, 52.072, -0.628, 110.0, 90.0)
STAYS = '#!/bin/sh\necho "$PX4_SIM_MODEL $PX4_HOME_LAT $PX4_HOME_ALT $@" > called\nexec sleep 30\n'
SECOND_FAILS = """#!/bin/sh
case "$*" in *"--sysid 2"*) printf "\\033[31mbind failed\\033[0m\\n"; exit 3;; esac
exec sleep 30
"""
STUBBORN = "#!/bin/sh\ntrap '' TERM\necho > called\nwhile true; do sleep 0.1; done\n"


def program(folder: Path, name: str, text: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text)
    path.chmod(0o755)
    return path


def built_px4(tmp_path: Path, text: str = STAYS) -> Path:
    (tmp_path / "build/etc/init.d-posix").mkdir(parents=True)
    (tmp_path / "build/etc/init.d-posix/rcS").touch()
    return program(tmp_path / "build/bin", "px4", text)


def spec(tmp_path: Path, *ids: int) -> str:
    vehicles = [{"system_id": i, "lat_deg": 52.0, "lon_deg": -0.6, "ground_amsl_m": 110.0} for i in ids]
    path = tmp_path / "spec.json"
    path.write_text(json.dumps({"vehicles": vehicles}))
    return str(path)


# ---------------------------------------------------------------- command lines


def test_an_arducopter_has_its_id_home_port_and_parameters_that_let_it_arm(tmp_path):
    command, environment = arducopter(PLACE, Options(Path("/b/arducopter"), ("127.0.0.1", 14560)), tmp_path)
    text = " ".join(command)
    assert text.startswith("/b/arducopter --model + --speedup 1 --home 52.0720000,-0.6280000,110,90 --defaults ")
    assert "-I 3 --sysid 3 --serial0 udpclient:127.0.0.1:14560 --serial1 none --serial2 none" in text
    assert "FRAME_CLASS 1" in Path(command[command.index("--defaults") + 1]).read_text()
    assert environment == {}


def test_parameters_of_the_users_own_take_the_place_of_ours(tmp_path):
    options = Options(Path("/b/arducopter"), ("127.0.0.1", 14560), parameters=Path("/p/mine.parm"), speed=5.0)
    command, _ = arducopter(PLACE, options, tmp_path)
    assert "--speedup 5 " in " ".join(command)
    assert command[command.index("--defaults") + 1] == "/p/mine.parm"
    assert list(tmp_path.iterdir()) == []


def test_a_px4_is_instance_id_minus_one_with_its_home_in_the_environment(tmp_path, monkeypatch):
    monkeypatch.delenv("PX4_SIM_MODEL", raising=False)
    binary = built_px4(tmp_path)
    command, environment = px4(PLACE, Options(binary, ("127.0.0.1", 14550)), tmp_path)
    assert command == [str(binary), "-i", "2", "-d", str(tmp_path / "build/etc")]
    assert environment == {
        "PX4_SIM_MODEL": "sihsim_quadx",
        "PX4_HOME_LAT": "52.0720000",
        "PX4_HOME_LON": "-0.6280000",
        "PX4_HOME_ALT": "110",
    }
    _, faster = px4(PLACE, Options(binary, ("127.0.0.1", 14550), speed=2.0), tmp_path)
    assert faster["PX4_SIM_SPEED_FACTOR"] == "2"


def test_a_px4_sends_to_one_port_only(tmp_path):
    with pytest.raises(LaunchError, match="14550 only"):
        px4(PLACE, Options(built_px4(tmp_path), ("127.0.0.1", 14560)), tmp_path)


def test_a_px4_without_its_build_beside_it_is_refused(tmp_path):
    with pytest.raises(LaunchError, match="no etc directory"):
        px4(PLACE, Options(program(tmp_path, "px4", STAYS), ("127.0.0.1", 14550)), tmp_path)


def test_a_program_that_is_missing_is_named_with_what_to_do(tmp_path):
    with pytest.raises(LaunchError, match=r"arducopter is not on PATH: build it .*--binary"):
        find("arducopter", None, str(tmp_path))
    with pytest.raises(LaunchError, match="px4 is not on PATH: build it"):
        find("px4", None, str(tmp_path))
    with pytest.raises(LaunchError, match="--binary /nowhere"):
        find("px4", "/nowhere/px4")
    (tmp_path / "arducopter").touch()  # may not be run
    with pytest.raises(LaunchError, match="may be run"):
        find("arducopter", str(tmp_path / "arducopter"))
    assert find("arducopter", None, str(program(tmp_path, "arducopter", STAYS).parent)) == tmp_path / "arducopter"


# ---------------------------------------------------------------- processes

TARGET = ["--target", "127.0.0.1:14550"]


def start(tmp_path: Path, autopilot: str, binary: Path, *ids: int, options: tuple[str, ...] = ()) -> subprocess.Popen:
    command = [
        sys.executable,
        "-m",
        "sitl.launch.real",
        autopilot,
        "--binary",
        str(binary),
        "--spec",
        spec(tmp_path, *ids),
    ]
    command += [*TARGET, "--folder", str(tmp_path / "state"), *options]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)


def called(tmp_path: Path, name: str) -> str:
    """How a program was called, once it was."""
    path = tmp_path / "state" / name / "called"
    end = time.monotonic() + 10.0
    while not (path.exists() and path.read_text()):
        assert time.monotonic() < end, f"{name} was not started"
        time.sleep(0.02)
    return path.read_text()


def running(tmp_path: Path) -> int:
    """How many processes work in our directories."""
    count = 0
    for entry in Path("/proc").iterdir():
        try:
            count += entry.name.isdigit() and str((entry / "cwd").readlink()).startswith(str(tmp_path / "state"))
        except OSError:
            continue
    return count


def none_left(tmp_path: Path) -> bool:
    end = time.monotonic() + 5.0
    while running(tmp_path) and time.monotonic() < end:
        time.sleep(0.05)
    return running(tmp_path) == 0


needs_proc = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc; a kernel that ends children")


@pytest.mark.process
@needs_proc
def test_vehicles_run_in_directories_of_their_own_and_end_with_us(tmp_path):
    launcher = start(tmp_path, "px4", built_px4(tmp_path), 1, 2)
    etc = tmp_path / "build/etc"
    assert called(tmp_path, "px4-1").endswith(f"52.0000000 110 -i 0 -d {etc}\n")
    assert called(tmp_path, "px4-2").endswith(f"52.0000000 110 -i 1 -d {etc}\n")
    assert running(tmp_path) == 2
    launcher.terminate()
    _, error = launcher.communicate(timeout=10.0)
    assert (launcher.returncode, error) == (0, "")
    assert none_left(tmp_path)


@pytest.mark.process
@needs_proc
def test_vehicles_end_with_us_even_if_we_are_killed_and_their_directories_are_free_again(tmp_path):
    binary = program(tmp_path, "arducopter", STUBBORN)
    launcher = start(tmp_path, "arducopter", binary, 7)
    called(tmp_path, "arducopter-7")
    second = start(tmp_path, "arducopter", binary, 7)
    _, error = second.communicate(timeout=10.0)
    assert second.returncode == 2
    assert "arducopter 7 flies already" in error
    launcher.send_signal(signal.SIGKILL)
    launcher.wait(10.0)
    launcher.stderr.close()
    assert none_left(tmp_path)
    gone = str(launcher.pid)
    third = start(tmp_path, "arducopter", binary, 7, options=("--parent", gone, "--wipe"))
    _, error = third.communicate(timeout=10.0)
    assert (third.returncode, error) == (0, ""), "not locked any more, and ends without the parent it should have"
    assert none_left(tmp_path)


@pytest.mark.process
@needs_proc
def test_a_vehicle_that_cannot_start_ends_all_and_its_words_are_shown(tmp_path):
    launcher = start(tmp_path, "arducopter", program(tmp_path, "arducopter", SECOND_FAILS), 1, 2)
    _, error = launcher.communicate(timeout=10.0)
    assert launcher.returncode == 1
    assert "arducopter 2 ended with status 3" in error
    assert "    bind failed\n" in error
    assert none_left(tmp_path)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["--target", "14550"], "--target 14550"),
        (["--speed", "0"], "--speed 0: must be 0.1 to 100"),
        (["--params", "gone.parm"], "--params gone.parm: there is no such file"),
        (["--binary", "gone"], "--binary gone"),
        (["--spec", "gone.json"], "gone.json: No such file"),
    ],
)
def test_a_bad_option_is_one_clear_line(tmp_path, capsys, options, problem):
    usual = ["--spec", spec(tmp_path, 1), *TARGET, "--folder", str(tmp_path), "--binary", "/bin/sh"]
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        assert main(["arducopter", *usual, *options]) == 2
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    error = capsys.readouterr().err
    assert problem in error
    assert error.count("\n") == 1
