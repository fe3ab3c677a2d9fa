"""The wheel, as a stranger gets it: built, installed apart from the source, and flown with it.

`make flights` tries it on the running Python, with the dependencies that are installed beside it. With TUI_GCS_PYTHONS
(paths of interpreters, as `make distcheck` sets it) each of them is tried, with dependencies from the package index.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PYTHONS = os.environ.get("TUI_GCS_PYTHONS", "").split(os.pathsep)
"""Interpreters; "" is the running one."""
SOURCES = ("tui_gcs", "sitl", "pyproject.toml", "README.md", "LICENSE", "NOTICE")

pytestmark = [pytest.mark.long, pytest.mark.process]


def run(*command: str | Path, cwd: Path) -> str:
    """Run a command that must succeed, with no way back to the source; its output."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "COV"))}
    environment |= {"TUI_GCS_STATE_DIR": str(cwd / "state"), "TUI_GCS_RUNTIME_DIR": str(cwd / "run")}
    done = subprocess.run([str(word) for word in command], cwd=cwd, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}: {done.stdout[-2000:]}{done.stderr[-2000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from a copy so that nothing is left in the tree."""
    copy = tmp_path_factory.mktemp("source")
    for name in SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(ROOT / name, copy)
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", copy / "dist", copy, cwd=copy)
    return next((copy / "dist").glob("*.whl"))


def install(wheel: Path, python: str, folder: Path) -> Path:
    """Install the wheel into a new environment; the folder of its programs."""
    run(python or sys.executable, "-m", "venv", "venv", cwd=folder)
    programs = folder / "venv/bin"
    pip = (programs / "python", "-m", "pip", "--quiet", "install")
    if python:
        run(*pip, "--constraint", ROOT / "constraints.txt", wheel, cwd=folder)
        return programs
    run(*pip, "--no-deps", "--no-index", wheel, cwd=folder)
    # The path of the running environment, after its own: its dependencies are found, and not its link to the source,
    # which is a .pth file there.
    own = run(programs / "python", "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=folder).strip()
    Path(own, "dependencies.pth").write_text(sysconfig.get_path("purelib"), encoding="utf-8")
    return programs


@pytest.mark.parametrize("python", PYTHONS)
def test_an_installed_wheel_flies(wheel: Path, python: str, tmp_path: Path) -> None:
    programs = install(wheel, python, tmp_path)
    tui_gcs = programs / "tui-gcs"

    where = run(programs / "python", "-c", "import tui_gcs, sitl; print(tui_gcs.__file__, sitl.__file__)", cwd=tmp_path)
    assert all(name.startswith(str(tmp_path)) for name in where.split())
    described = "from importlib.metadata import metadata; print(metadata('tui-gcs')['License-Expression'])"
    assert run(programs / "python", "-c", described, cwd=tmp_path).strip() == "Apache-2.0"
    assert "packages" in run(tui_gcs, "doctor", cwd=tmp_path)
    run(tui_gcs, "scenario", "new", "field.toml", "--vehicles", "2", cwd=tmp_path)
    field = tmp_path / "field.toml"
    # A small zone for ten seconds is enough to see everything that is installed at work.
    text = field.read_text(encoding="utf-8").replace("radius_m = 80.0", "radius_m = 25.0")
    field.write_text(text.replace("duration_s = 300.0", "duration_s = 10.0"), encoding="utf-8")
    flown = run(tui_gcs, "demo", "--headless", "--scenario", field, cwd=tmp_path)
    assert "checks hold" in flown.splitlines()[-1]
