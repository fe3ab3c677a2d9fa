"""The walls of the architecture: who may import whom, and what nobody may write.

Read from the source (AST), so that an import inside a function counts too.
"""

import ast
import gc
import inspect
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import get_type_hints

import pytest

from tui_gcs.core.guard.permission import Order, Permission, SetpointPermission
from tui_gcs.core.uplink.uplink import Uplink

pytestmark = pytest.mark.xdist_group("walls")  # one worker parses the sources
ROOT = Path(__file__).parents[1]
SOURCES = sorted(p for top in ("tui_gcs", "sitl") for p in (ROOT / top).rglob("*.py"))
MODULES = {".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): p for p in SOURCES}
MAX_FILES_FLAT = 25
MIN_DOOR_LINES = 3

FLOORS = (
    ("base", "geometry", "plans"),
    ("scenario", "mavlink"),
    ("protocol", "records", "links"),
    ("fleet",),
    ("signing", "motion", "alarms"),
    ("guard",),
    ("uplink",),
    ("firmware",),
    ("flight", "missions", "rates", "forward"),
    ("services", "judging"),
    ("station", "formats"),
    ("preflight", "requests"),
    ("process",),
)
"""The packages of `tui_gcs/core` from the ground up; imports lead down, or to the left on the same floor."""

UPPER_FLOORS = (
    "core",
    "planner",
    "client",
    "rehearsal",
    "terminal",
    "actions",
    "feed",
    "widgets",
    "screens",
    "console",
    "app",
    "cli",
)
"""The packages of `tui_gcs` from the ground up."""

CONSOLE_FOLDERS = tuple(f"tui_gcs/{name}" for name in UPPER_FLOORS[UPPER_FLOORS.index("terminal") :])

BROAD_EXCEPT_ALLOWED = {
    "tui_gcs/planner/runtime/host.py",  # foreign code runs here
    "tui_gcs/planner/runtime/vehicle_instance.py",  # the same, for one vehicle
    "tui_gcs/planner/runtime/bus_adapter.py",  # and makes previews here
    "tui_gcs/planner/runtime/registry.py",  # and is imported here
    "tui_gcs/planner/runtime/planner_file.py",  # or run from its file here
    "tui_gcs/planner/check/subject.py",  # and asked for its state here
    "tui_gcs/planner/patrol/background_search.py",  # a thread's error is raised again where it is waited for
    "tui_gcs/core/records/onboard_logs.py",  # pymavlink's reader raises plain Exception, which is told apart
    "tui_gcs/core/process/station_process.py",  # the edge of a process: logs and ends
}
PLANNER_MACHINERY = (
    "tui_gcs/planner/runtime/",
    "tui_gcs/planner/check/",
    "tui_gcs/planner/api.py",
    "tui_gcs/planner/avoidance.py",
    "tui_gcs/planner/energy_cost.py",
    "tui_gcs/planner/keep_clear.py",
    "tui_gcs/planner/radio.py",
    "tui_gcs/planner/surroundings.py",
)
"""The rest of planner/ is planners, written against `planner.api` only, like anybody's."""


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), filename=str(path))


@cache
def nodes_of(path: Path) -> dict[type[ast.AST], list[ast.AST]]:
    """All nodes of a module by their kind, so that a million nodes are walked once and not by every test."""
    nodes: dict[type[ast.AST], list[ast.AST]] = defaultdict(list)
    for node in ast.walk(tree_of(path)):
        nodes[type(node)].append(node)
    return nodes


@pytest.fixture(scope="module", autouse=True)
def forgotten() -> Iterator[None]:
    """Removes a million nodes: tests that come later in this process and look for garbage would look through them.

    The garbage collector rests meanwhile, because all that these tests make is kept to their end.
    """
    gc.disable()
    yield
    gc.enable()
    for cached in (tree_of, nodes_of, imports, edges):
        cached.cache_clear()


@cache
def imports(path: Path) -> list[str]:
    """Every imported module; `from a import b` as `a.b`, for b may be a module."""
    package = path.relative_to(ROOT).parent.parts
    names = [alias.name for node in nodes_of(path)[ast.Import] for alias in node.names]
    for node in nodes_of(path)[ast.ImportFrom]:
        base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
        module = ".".join(filter(None, (base, node.module)))
        names += [f"{module}.{alias.name}" for alias in node.names]
    return names


def within(module: str, *tops: str) -> bool:
    return any(module == top or module.startswith(f"{top}.") for top in tops)


def breaches(folder: str, forbidden: tuple[str, ...], excepted: tuple[str, ...] = ()) -> list[str]:
    """`file imports module` for every import of something forbidden below `folder`."""
    return [
        f"{name_of(path)} imports {module}"
        for path in SOURCES
        if within(name_of(path).removesuffix(".py").replace("/", "."), folder.replace("/", "."))
        and not name_of(path).startswith(excepted)
        for module in imports(path)
        if within(module, *forbidden)
    ]


def nodes_in_sources(kind: type[ast.AST]) -> Iterator[tuple[Path, ast.AST]]:
    for path in SOURCES:
        yield from ((path, node) for node in nodes_of(path)[kind])


def test_there_is_something_to_look_at() -> None:
    assert {"core", "planner", "screens", "widgets"} <= {p.parent.name for p in SOURCES}
    assert "tui_gcs.core.geometry.zones.Zone" in set(imports(ROOT / "tui_gcs/core/scenario/model.py"))


@pytest.mark.parametrize("folder", ["tui_gcs/core", "tui_gcs/planner", "sitl", "tui_gcs/rehearsal"])
def test_no_textual_below_the_console(folder: str) -> None:
    assert breaches(folder, ("textual",)) == []


def test_core_knows_nothing_of_what_is_above_it() -> None:
    above = [f"tui_gcs.{p.name.removesuffix('.py')}" for p in (ROOT / "tui_gcs").iterdir()]
    assert (
        breaches("tui_gcs/core", tuple(name for name in above if name not in ("tui_gcs.core", "tui_gcs.__init__")))
        == []
    )


PRIVATE_TEXTUAL = ("_compositor", "_bindings", "_driver", "_writer_thread", "_display", "_background_screens", "_queue")


def test_private_parts_of_textual_are_used_in_one_package() -> None:
    private = "tui_gcs/terminal/private/"
    modules = [
        f"{name_of(path)} imports {module}"
        for path in SOURCES
        if not name_of(path).startswith(private)
        for module in imports(path)
        if module.startswith(("textual.", "rich.")) and any(part.startswith("_") for part in module.split("."))
    ]
    attributes = [
        f"{name_of(path)}:{node.lineno} {node.attr}"
        for path, node in nodes_in_sources(ast.Attribute)
        if name_of(path).startswith(CONSOLE_FOLDERS) and not name_of(path).startswith(private)
        if node.attr in PRIVATE_TEXTUAL
        or (isinstance(node.value, ast.Name) and node.value.id in ("app", "screen", "widget") and is_private(node.attr))
    ]
    assert (modules, attributes) == ([], [])


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


def test_sitl_knows_nothing_of_tui_gcs() -> None:
    assert breaches("sitl", ("tui_gcs",)) == []


def test_sitl_is_known_in_rehearsal_alone() -> None:
    assert {line.split()[0] for line in breaches("tui_gcs", ("sitl",))} == {"tui_gcs/rehearsal/lock_step.py"}


def test_planners_are_written_against_the_api_only() -> None:
    known = {name_of(p) for p in SOURCES}
    assert "tui_gcs/planner/patrol/patrol.py" in known
    foreign = [b for b in breaches("tui_gcs/planner", ("tui_gcs",), PLANNER_MACHINERY) if " tui_gcs.planner." not in b]
    assert foreign == []


@pytest.mark.parametrize("folder", ["tui_gcs/screens", "tui_gcs/widgets"])
def test_screens_and_widgets_know_no_protocol(folder: str) -> None:
    protocol = tuple(f"tui_gcs.core.{part}" for part in ("mavlink", "links", "services", "firmware", "uplink"))
    assert breaches(folder, (*protocol, "pymavlink", "zenoh", "tui_gcs.core.protocol.zenoh_bus")) == []


def test_station_never_imports_a_planner_and_planners_no_station() -> None:
    assert breaches("tui_gcs/planner", ("tui_gcs.core.station", "tui_gcs.screens")) == []
    assert breaches("tui_gcs/core", ("tui_gcs.planner",)) == []


def module_of(name: str) -> str | None:
    """The module of the sources that an imported name is in, or is; None for a library's."""
    while name and name not in MODULES:
        name = name.rpartition(".")[0]
    return name or None


@cache
def edges() -> dict[str, set[str]]:
    """Which modules each module imports: under TYPE_CHECKING and within functions, too."""
    found: dict[str, set[str]] = {}
    for module, path in MODULES.items():
        targets = {module_of(name) for name in imports(path)}
        # A door is imported with everything behind it: only who asks for its own names depends on it.
        found[module] = {name for name in targets if name and name != module and not module.startswith(f"{name}.")}
    return found


def upward(rooms: list[str], top: str) -> list[str]:
    """`module imports module` for every import that leads from a room below `top` to one that stands after it."""

    def room(module: str) -> int | None:
        name = module.removeprefix(f"{top}.").partition(".")[0]
        return rooms.index(name) if module.startswith(f"{top}.") and name in rooms else None

    ranked = [(module, room(module), name, room(name)) for module, names in edges().items() for name in sorted(names)]
    return [f"{module} imports {name}" for module, mine, name, its in ranked if None not in (mine, its) and its > mine]


def test_every_room_of_the_core_has_its_floor() -> None:
    rooms = {p.name for p in (ROOT / "tui_gcs/core").iterdir() if p.is_dir() and p.name != "__pycache__"}
    assert rooms == {room for floor in FLOORS for room in floor}


def test_imports_of_the_core_lead_down() -> None:
    assert upward([room for floor in FLOORS for room in floor], "tui_gcs.core") == []


def test_packages_import_downwards() -> None:
    assert upward(list(UPPER_FLOORS), "tui_gcs") == []


def test_no_modules_import_each_other_in_a_circle() -> None:
    TopologicalSorter(edges()).prepare()  # raises CycleError, which names the circle


def test_nothing_stands_flat_and_no_folder_is_crowded() -> None:
    assert {p.name for p in (ROOT / "tui_gcs").glob("*.py")} <= {"__init__.py", "__main__.py", "app.py"}
    folders = Counter(p.parent for p in (*SOURCES, *(ROOT / "tests").rglob("*.py")) if p.name != "__init__.py")
    assert {name_of(folder): count for folder, count in folders.items() if count > MAX_FILES_FLAT} == {}


def test_every_package_has_a_door() -> None:
    doors = [p for p in SOURCES if p.name == "__init__.py"]
    assert [name_of(p) for p in doors if len((ast.get_docstring(tree_of(p)) or "").splitlines()) < MIN_DOOR_LINES] == []


def test_a_class_name_means_one_thing() -> None:
    """The simulator is an oracle of its own: it may have a name that the station has, too."""
    for top in ("tui_gcs", "sitl"):
        names = Counter(
            node.name
            for path in SOURCES
            if name_of(path).startswith(f"{top}/")
            for node in tree_of(path).body
            if isinstance(node, ast.ClassDef)
        )
        assert [name for name, count in names.items() if count > 1] == []


def modules_after(code: str) -> set[str]:
    """Names in sys.modules of a fresh interpreter that ran `code`."""
    script = (
        f"import sys\ntry:\n    {code}\nexcept SystemExit:\n    pass\nprint('|'.join(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=True)
    return set(done.stderr.strip().splitlines()[-1].split("|"))


def test_core_and_planner_leave_textual_out_of_the_process() -> None:
    files = [p for p in SOURCES if name_of(p).startswith(("tui_gcs/core/", "tui_gcs/planner/"))]
    names = [name_of(p).removesuffix(".py").removesuffix("/__init__").replace("/", ".") for p in files]
    loaded = modules_after("import " + ", ".join(names))
    assert set(names) <= loaded
    assert not loaded & {"textual", "sitl", "tui_gcs.app"}


def test_help_is_light() -> None:
    loaded = modules_after("from tui_gcs.cli.main import main; main(['--help'])")
    assert "tui_gcs.cli.main" in loaded
    assert not loaded & {"textual", "rich", "numpy", "shapely", "scipy", "pymavlink", "zenoh", "msgspec", "asyncio"}


def test_no_global_statement() -> None:
    assert [f"{name_of(path)}:{node.lineno}" for path, node in nodes_in_sources(ast.Global)] == []


def test_no_heap_of_utilities() -> None:
    assert [name_of(p) for p in SOURCES if p.stem in ("utils", "util", "helpers", "misc", "common_utils")] == []


# ---------------------------------------------------------------- permissions

SENDERS = {
    "tui_gcs/core/uplink/uplink.py": {"_put: self._links[link].send"},
    "tui_gcs/core/forward/ports.py": {
        f"{function}: self.link.send" for function in ("send_as", "send_own", "send_waiting")
    },
    # `VehicleAction.send`: it calls the uplink.
    "tui_gcs/core/uplink/commands.py": {"_send_copy: action.send"},
    "tui_gcs/core/rates/rate_controller.py": {"_submit: action.send"},
    "tui_gcs/core/flight/steering.py": {"hold_action: action.send"},
    "tui_gcs/core/process/station_process.py": {"_wake: writer.send"},
}
"""What reads an attribute by which bytes leave, by function: `_put` of the uplink to vehicles, the ports of the
forwarder to other stations, and things that are no links."""
SEND = ("send", "sendto", "sendall", "sendmsg")
SOCKETS = ("tui_gcs/core/links/", "tui_gcs/core/process/station_process.py", "tui_gcs/client/", "tui_gcs/cli/")
"""Who may open a socket. The last two are other processes, which look for free ports."""
PERMITTING = {
    "Verdict": ("tui_gcs/core/guard/",),
    "PASS": ("tui_gcs/core/guard/",),
    "Question": ("tui_gcs/core/uplink/",),
    "StopReason": (
        "tui_gcs/core/uplink/uplink.py",
        "tui_gcs/core/firmware/",
        "tui_gcs/core/flight/steering.py",
        "tui_gcs/core/flight/return_home.py",
        "tui_gcs/core/requests/flight_requests.py",
        "tui_gcs/core/requests/vehicle_requests.py",
        "tui_gcs/core/services/setup/motor_test.py",
    ),
}
"""Who may make a permission: the guard its verdicts, the uplink questions, and those that stop vehicles a stop reason.
"""


def ways_out(function: ast.AST) -> set[str]:
    """Every expression in `function` that names a way for bytes to leave, whether it is called there or passed on."""
    named = {ast.unparse(node) for node in ast.walk(function) if isinstance(node, ast.Attribute) and node.attr in SEND}
    # By name: getattr, operator.methodcaller, attrgetter.
    texts = {
        ast.unparse(node)
        for call in ast.walk(function)
        if isinstance(call, ast.Call)
        for node in call.args
        if isinstance(node, ast.Constant) and node.value in SEND
    }
    return named | texts


def senders_in(sources: Iterator[tuple[Path, ast.AST]]) -> dict[str, set[str]]:
    """By file of the core, links apart, the functions with such expressions."""
    found: dict[str, set[str]] = {}
    for path, function in sources:
        name = name_of(path)
        if not name.startswith("tui_gcs/core/") or name.startswith("tui_gcs/core/links/"):
            continue
        of = getattr(function, "name", "lambda")
        if ways := {f"{of}: {way}" for way in ways_out(function)}:
            found.setdefault(name, set()).update(ways)
    return found


def test_only_one_function_sends_to_vehicles_and_it_needs_a_permission() -> None:
    assert senders_in(nodes_in_sources(ast.FunctionDef)) == SENDERS
    assert senders_in(nodes_in_sources(ast.AsyncFunctionDef)) == {}
    # A function within another one, or a lambda, is seen as a part of it; this is one outside of all.
    assert {name: ways for name, ways in senders_in(nodes_in_sources(ast.Lambda)).items() if name not in SENDERS} == {}
    for needed in (Uplink._put, Uplink._ways, Uplink._send):
        assert get_type_hints(needed)["permission"] == Permission
        assert inspect.signature(needed).parameters["permission"].default is inspect.Parameter.empty
    assert get_type_hints(Uplink.setpoint)["permission"] == SetpointPermission
    assert get_type_hints(Uplink.action)["order"] is Order


@pytest.mark.parametrize(
    "bypass",
    [
        "link.send(data, to)",
        "out = links[name]; out.send(data, to=to)",
        "out = links[name].send; out(data, to)",
        "partial(links[name].send, data)(to)",
        "getattr(links[name], 'send')(data, to)",
        "methodcaller('send', data, to)(links[name])",
        "(lambda: self._link.send(data, to))()",
        "self._socket.sendto(data, to)",
    ],
)
def test_a_way_past_the_uplink_would_be_found(bypass: str) -> None:
    function = ast.parse(f"def anything():\n    {bypass}").body[0]
    path = ROOT / "tui_gcs/core/flight/executive.py"
    assert senders_in(iter([(path, function)])).keys() == {"tui_gcs/core/flight/executive.py"}


def test_sockets_are_opened_where_links_are_and_the_uplink_keeps_its_parts_to_itself() -> None:
    opened = {
        name_of(path)
        for kind in (ast.Import, ast.ImportFrom)
        for path, node in nodes_in_sources(kind)
        if name_of(path).startswith("tui_gcs/")
        and {"socket", "serial"} & {getattr(node, "module", None), *(alias.name for alias in node.names)}
    }
    assert {name for name in opened if not name.startswith(SOCKETS)} == set()
    private = {
        f"{name_of(path)}: {ast.unparse(node)}"
        for path, node in nodes_in_sources(ast.Attribute)
        if node.attr.startswith("_") and ast.unparse(node.value).rpartition(".")[2] in ("uplink", "_uplink")
    }
    assert private == set()


def called(node: ast.Call) -> str:
    """The name of what is called, whatever module or object it is taken from."""
    return getattr(node.func, "attr", getattr(node.func, "id", ""))


def test_permissions_are_made_by_the_guard_and_by_what_stops_vehicles() -> None:
    made = {
        (kind, name_of(path)) for path, node in nodes_in_sources(ast.Call) if (kind := called(node)) in PERMITTING
    } | {
        ("PASS", name_of(path))
        for path, node in nodes_in_sources(ast.ImportFrom)
        for alias in node.names
        if alias.name == "PASS" and node.module == "tui_gcs.core.guard.permission"
    }
    renamed = [
        f"{name_of(path)}: {alias.name} as {alias.asname}"
        for path, node in nodes_in_sources(ast.ImportFrom)
        for alias in node.names
        if alias.name in PERMITTING and alias.asname
    ]
    assert renamed == []
    assert [(kind, name) for kind, name in sorted(made) if not name.startswith(PERMITTING[kind])] == []


def test_no_markup_is_made_of_text() -> None:
    marked = [
        f"{name_of(path)}:{node.lineno}"
        for path, node in nodes_in_sources(ast.Call)
        for keyword in node.keywords
        if keyword.arg == "markup" and not (isinstance(keyword.value, ast.Constant) and keyword.value.value is False)
    ]
    assert marked == []


def is_broad(handler: ast.ExceptHandler) -> bool:
    names = handler.type.elts if isinstance(handler.type, ast.Tuple) else [handler.type]
    return any(n is None or (isinstance(n, ast.Name) and n.id in ("Exception", "BaseException")) for n in names)


def test_broad_except_only_at_edges() -> None:
    broad = {name_of(path) for path, node in nodes_in_sources(ast.ExceptHandler) if is_broad(node)}
    assert broad - BROAD_EXCEPT_ALLOWED == set()


def test_nothing_of_this_machine_is_in_the_sources() -> None:
    absolute = ("/home/", "/root/", "/work/", "/Users/", "/proc/")
    held = [
        f"{name_of(path)}:{node.lineno} {node.value!r}"
        for path, node in nodes_in_sources(ast.Constant)
        if isinstance(node.value, str) and any(part in node.value for part in absolute)
    ]
    assert held == []


def test_no_screen_of_the_console_takes_scipy_with_it() -> None:
    """It is 40 MB and 0.4 s; who plans takes it when it is needed."""
    screens = ("plan.plan_screen", "missions.missions_screen")
    names = ("tui_gcs.app", "tui_gcs.widgets.map.stored_plans_layer", *(f"tui_gcs.screens.{name}" for name in screens))
    loaded = modules_after(f"import {', '.join(names)}")
    assert "tui_gcs.app" in loaded and "scipy" not in loaded
