"""The rooms of `sitl` as floors of a house: a module imports from lower floors and from its own room only."""

import ast
from pathlib import Path

import sitl

ROOT = Path(sitl.__file__).parent
FLOORS = (
    "links",  # MAVLink frames, signing, what bad links do to datagrams
    "physics",  # point masses, position control of PX4, weather
    "common",  # what both autopilots are built on
    "services",  # MAVLink services of both autopilots
    "ardupilot",
    "px4",
    "launch",  # fleets, programs, sockets
)
"""From the ground up. `ardupilot` and `px4` are neighbours and do not know each other."""
STRANGERS = {("ardupilot", "px4"), ("px4", "ardupilot"), ("links", "physics"), ("physics", "links")}
MODULES = sorted(ROOT.rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Modules of `sitl` that a file imports, inside functions and under TYPE_CHECKING too."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0 and node.module, f"{path}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names} | {node.module}
    return {name for name in found if name.startswith("sitl.")}


def name_of(path: Path) -> str:
    return ".".join(("sitl", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")


def test_the_floors_are_the_rooms() -> None:
    rooms = {path.name for path in ROOT.iterdir() if (path / "__init__.py").exists()}
    assert rooms == set(FLOORS)


def test_imports_lead_down() -> None:
    breaches = []
    for path in MODULES:
        room = path.relative_to(ROOT).parts[0]
        for name in imported(path):
            other = name.split(".")[1]
            if FLOORS.index(other) > FLOORS.index(room) or (room, other) in STRANGERS:
                breaches.append(f"{name_of(path)} imports {name}")
    assert breaches == []


def test_nothing_is_imported_for_types_only_or_inside_a_function() -> None:
    for path in MODULES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        assert "TYPE_CHECKING" not in path.read_text(encoding="utf-8"), path
        top = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
        every = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
        assert len(top) == len(every), path


def test_no_circle() -> None:
    names = {name_of(path) for path in MODULES}
    needs = {name_of(path): imported(path) & names for path in MODULES}
    while leaves := {name for name, below in needs.items() if not below & needs.keys()}:
        needs = {name: below for name, below in needs.items() if name not in leaves}
    assert needs == {}
