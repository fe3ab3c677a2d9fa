"""Writes `docs/reference/platforms.md`: for which platforms and Pythons every pinned dependency has a wheel.

    python docs/make_platforms.py        asks the package index, some minutes; needs pip >= 24

Pip resolves the run-time dependencies with `constraints.txt` for a foreign platform, wheels only; nothing is installed.
A platform is in the table as "yes" if all of them have a wheel there. Run it when pins change.
"""

import json
import subprocess
import sys
import tempfile
import tomllib
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/reference/platforms.md"
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
PLATFORMS = {
    "Linux x86-64 (glibc 2.28)": ("manylinux_2_28_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"),
    "Linux ARM64 (glibc 2.28)": ("manylinux_2_28_aarch64", "manylinux_2_17_aarch64", "manylinux2014_aarch64"),
    "macOS 14 Apple silicon": ("macosx_14_0_arm64",),
    "macOS 14 Intel": ("macosx_14_0_x86_64",),
}
"""Tags of wheels by the name of a platform: glibc 2.28 is Debian 10, Ubuntu 20.04, RHEL 8 and what is newer."""


def resolve(tags: tuple[str, ...], python: str, requirements: list[str]) -> dict[str, str] | str:
    """Wheels by project name, as pip would install them there; a text with pip's reason where it would not."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed", "--quiet"]
        command += ["--target", folder, "--only-binary=:all:", "--python-version", python]
        command += ["--constraint", str(ROOT / "constraints.txt"), "--report", f"{folder}/report.json"]
        command += [word for tag in tags for word in ("--platform", tag)]
        done = subprocess.run([*command, *requirements], capture_output=True, text=True, check=False)
        if done.returncode:
            errors = [line for line in done.stderr.splitlines() if line.startswith("ERROR:")]
            return errors[-1].removeprefix("ERROR: ") if errors else done.stderr[-200:]
        report = json.loads(Path(folder, "report.json").read_text(encoding="utf-8"))
    return {i["metadata"]["name"]: i["download_info"]["url"].rsplit("/", 1)[-1] for i in report["install"]}


def page(found: dict[tuple[str, str], dict[str, str] | str]) -> str:
    """The page's text."""
    rows = [f"| | {' | '.join(PYTHONS)} |", f"|---{'|---' * len(PYTHONS)}|"]
    reasons = []
    for platform in PLATFORMS:
        cells = []
        for python in PYTHONS:
            result = found[platform, python]
            cells.append("no" if isinstance(result, str) else "yes")
            if isinstance(result, str):
                reasons.append(f"* {platform}, Python {python}: {result}")
        rows.append(f"| {platform} | {' | '.join(cells)} |")
    wheels: dict[str, set[str]] = {}
    for result in found.values():
        for name, wheel in {} if isinstance(result, str) else result.items():
            wheels.setdefault(name, set()).add("-".join(wheel.split("-")[:2]))
            wheels[name].add("any" if wheel.endswith("none-any.whl") else "binary")
    names = []
    for name, kinds in sorted(wheels.items(), key=lambda item: item[0].lower()):
        version = next(kind.split("-")[1] for kind in kinds if "-" in kind)
        names.append(f"| {name} | {version} | {'one for each platform' if 'binary' in kinds else 'one for all'} |")
    return "\n".join(
        [
            "# Platforms",
            "",
            "Written by `docs/make_platforms.py`, which asks the package index with pip for wheels of every run-time",
            f"dependency as pinned in `constraints.txt`. Asked on {datetime.now(UTC):%Y-%m-%d}. *Yes* means: nothing",
            "has to be compiled there. Flights are tested on Linux x86-64 only: `make distcheck` installs the wheel",
            "and flies with it, the last time on Python 3.11, 3.12 and 3.13 (2026-11-27).",
            "",
            *rows,
            "",
            *([*reasons, ""] if reasons else []),
            "| dependency | version | wheels |",
            "|---|---|---|",
            *names,
            "",
        ]
    )


def main() -> None:
    """Ask, and write the page."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = {}
    for platform, tags in PLATFORMS.items():
        for python in PYTHONS:
            found[platform, python] = resolve(tags, python, project["dependencies"])
            sys.stderr.write(f"{platform}, Python {python}: {found[platform, python]}\n")
    PAGE.write_text(page(found), encoding="utf-8")


if __name__ == "__main__":
    main()
