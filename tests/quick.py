"""Prints the tests that belong to what changed, for `make quick`.

Changed is what differs from the last commit; if nothing does, what the last commit changed. Tests mirror the tree, so
a module's tests are `test_<module>.py` in the folder of the same name; where a module has none of its own, all tests of
its folder are taken. A changed test or rig counts for itself. The walls and the documents are always checked.
"""

import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[1]
ALWAYS = ("tests/test_walls.py", "tests/docs")


def changed() -> list[str]:
    """Paths of changed Python files, new ones included."""
    command = ["git", "status", "--porcelain", "--untracked-files=all", "--no-renames"]
    lines = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    paths = [line[3:] for line in lines]
    if not paths:
        command = ["git", "diff", "--name-only", "--no-renames", "HEAD~1"]
        paths = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    return [path for path in paths if path.endswith(".py")]


def tests_of(path: str) -> Path | None:
    """The test file of a module, or the nearest folder with tests that mirrors its own; None: there is none."""
    top, *inner = Path(path).parts
    if top == "tests":
        file = ROOT / path
        return file if file.name.startswith("test_") and file.exists() else None
    mirror = ROOT.joinpath("tests", *(inner if top == "tui_gcs" else (top, *inner)))
    own = mirror.with_name(f"test_{mirror.name}")
    if own.exists():
        return own
    folder = next((folder for folder in mirror.parents if folder.is_dir()), None)
    return None if folder is None or folder == ROOT / "tests" else folder


def main() -> None:
    """Print the paths, relative to the repository, each once."""
    found = {file.relative_to(ROOT).as_posix() for path in changed() if (file := tests_of(path)) is not None}
    print(*ALWAYS, *sorted(found), sep="\n")


if __name__ == "__main__":
    main()
