"""Writes the reference of the manual from the code, and the manual page: nothing in them is copied by hand.

    python docs/make_reference.py            into docs/reference/, for `make docs`; git ignores the pages
    python docs/make_reference.py --man      man/tui-gcs.1, for `make dist`
    python docs/make_reference.py --schema   docs/reference/report.schema.json, which is part of the repository

Commands come from the parser, keys from the action tables, scenario keys and messages from their structs, settings and
exit codes from their tables. The planner interface is read by mkdocstrings.
"""

import argparse
import ast
import importlib
import inspect
import itertools
import json
import pkgutil
import re
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, get_args, get_origin, get_type_hints

import msgspec

from tui_gcs import __version__
from tui_gcs.actions.scopes import SCOPES
from tui_gcs.cli import exit_codes
from tui_gcs.cli.command_report import CommandReport
from tui_gcs.cli.installation.general_options import commands
from tui_gcs.cli.main import command_line_parser
from tui_gcs.client.user_settings import SETTINGS
from tui_gcs.core import protocol
from tui_gcs.core.alarms.causes import CAUSES
from tui_gcs.core.scenario import model

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs/reference"
GENERAL = ("help", "verbose", "quiet", "no_color")
"""Options that every command has: they stand once."""


def cell(text: str) -> str:
    """Text in a cell of a table: one line, without what Markdown would take for a mark."""
    return re.sub(r"([|<>*\[\]])", r"\\\1", " ".join(text.split()))


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    """A table, or nothing where it would be empty."""
    if not rows:
        return []
    lines = [head, ("---",) * len(head), *rows]
    return ["", *(f"| {' | '.join(row)} |" for row in lines), ""]


def names(action: argparse.Action) -> str:
    """An option or argument as it is typed."""
    value = action.metavar if action.metavar is not None else action.dest.upper()
    value = " ".join(value) if isinstance(value, tuple) else value
    if action.choices and action.metavar is None:
        value = "|".join(map(str, action.choices))
    if not action.option_strings:
        return f"[{value}]" if action.nargs in ("?", "*") else value
    return ", ".join(action.option_strings) + ("" if action.nargs == 0 else f" {value}")


def arguments_of(parser: argparse.ArgumentParser, general: bool) -> Iterator[tuple[str, str]]:
    """What a command takes: how it is typed, and what it means."""
    for action in parser._actions:
        hidden = action.help == argparse.SUPPRESS or isinstance(action, argparse._SubParsersAction)
        if not hidden and (action.dest in (*GENERAL, "version")) is general:
            yield names(action), (action.help or "").replace("%%", "%")


def cli() -> str:
    """Every command."""
    parser = command_line_parser()
    lines = ["# Command line", "", "Every command takes these, before or after its name:"]
    lines += table(
        ("option", "meaning"), [(f"`{n}`".replace("|", "\\|"), cell(t)) for n, t in arguments_of(parser, True)]
    )
    for path, command in commands(parser):
        if not path or any(isinstance(a, argparse._SubParsersAction) for a in command._actions):
            if path:
                lines += [f"## tui-gcs {' '.join(path)}", "", command.description or "", ""]
                lines += ["```text", command.epilog, "```", ""] if command.epilog else []
            continue
        lines += [f"{'##' if len(path) == 1 else '###'} tui-gcs {' '.join(path)}", "", cell(command.description or "")]
        lines += table(
            ("argument", "meaning"), [(f"`{n}`".replace("|", "\\|"), cell(t)) for n, t in arguments_of(command, False)]
        )
        lines += ["```text", command.epilog, "```", ""] if command.epilog else []
    return "\n".join(lines)


def keys() -> str:
    """Every key, by screen."""
    lines = ["# Keys", "", 'A keymap file changes them by the names in the last column: `[fly]`, then `id = ["f5"]`.']
    for scope, actions in SCOPES.items():
        lines += ["", f"## {scope}"]
        rows = [(f"`{a.shown}`", cell(a.help), cell(a.group), f"`{a.id}`") for a in actions if a.help and a.shown]
        lines += table(("key", "what it does", "group", "id"), rows)
    return "\n".join(lines)


def alarms() -> str:
    """Every alarm, the most important first."""
    shown = {action.id: action.shown for actions in SCOPES.values() for action in actions}
    lines = [
        "# Alarms",
        "",
        "An alarm asks for an operator's act; the worst stands first on the screen. *After*: how long",
    ]
    lines += ["its cause must hold. `a` acknowledges it, `A` lists all."]
    for level in dict.fromkeys(cause.level for cause in CAUSES):
        rows = []
        for cause in CAUSES:
            act = re.sub(r"\[(\w+)\]", lambda found: shown.get(found[1], found[1]), cause.action)
            if cause.level is level:
                rows.append((cell(cause.title), f"`{cause.tag}`", cell(act), f"{cause.on_s:g} s"))
        lines += ["", f"## {level.name.capitalize()}", *table(("alarm", "tag", "what to do", "after"), rows)]
    return "\n".join(lines)


def fields(kind: type) -> Iterator[tuple[str, str, str, str]]:
    """Name, type, default and meaning of each field of a struct; meanings are the texts below the fields."""
    texts: dict[str, str] = {}
    body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    statements = body.body if isinstance(body, ast.ClassDef) else []
    for field, after in itertools.pairwise(statements):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(after, ast.Expr):
            texts[field.target.id] = str(getattr(after.value, "value", ""))
    hints = get_type_hints(kind, include_extras=True)
    for field in msgspec.structs.fields(kind):
        default = "required" if field.required else "" if field.default is msgspec.NODEFAULT else repr(field.default)
        yield field.encode_name, shown_type(hints[field.name]), default, texts.get(field.name, "")


def shown_type(hint: Any) -> str:
    """A type as it is read: ranges in words, structs by their names."""
    if get_origin(hint) is not None and hasattr(hint, "__metadata__"):
        base, *notes = get_args(hint)
        return " ".join([shown_type(base), *filter(None, (bounds(note) for note in notes))])
    if isinstance(hint, type) and get_origin(hint) is None:
        return hint.__name__
    return re.sub(r"\b(?:\w+\.)+(\w+)", r"\1", str(hint))


def bounds(note: Any) -> str:
    """The range that a field may have."""
    marks = (("ge", "≥"), ("gt", ">"), ("le", "≤"), ("lt", "<"))
    found = [f"{mark} {getattr(note, name):g}" for name, mark in marks if getattr(note, name, None) is not None]
    return ", ".join(found)


def structs(module: ModuleType, level: str) -> list[str]:
    """Each struct of a module with its fields."""
    lines = []
    for name, kind in inspect.getmembers(module, inspect.isclass):
        if kind.__module__ != module.__name__ or not issubclass(kind, msgspec.Struct):
            continue
        lines += ["", f"{level} {name}", "", cell((inspect.getdoc(kind) or "").split("\n\n")[0])]
        rows = [(f"`{n}`", f"`{t}`".replace("|", "\\|"), f"`{d}`" if d else "", cell(m)) for n, t, d, m in fields(kind)]
        lines += table(("field", "type", "default", "meaning"), rows)
    return lines


def scenario() -> str:
    """Every key of a scenario file."""
    shipped = (ROOT / "tui_gcs/scenarios/swarm-challenge.toml").read_text(encoding="utf-8")
    lines = [
        "# Scenario keys",
        "",
        "`tui-gcs check FILE.toml` names what is wrong with a scenario, by key. The shipped",
    ]
    lines += ["scenario shows every key in its place:", "", "```toml", shipped.rstrip(), "```", ""]
    lines += [
        "## What it becomes",
        "",
        "The values that a scenario has once it is read, with their ranges and defaults.",
    ]
    return "\n".join([*lines, *structs(model, "###")])


def messages() -> str:
    """Every message on the bus."""
    lines = ["# Messages on the bus", "", "msgpack by msgspec; unknown fields and wrong types are errors."]
    for found in sorted(pkgutil.iter_modules(protocol.__path__), key=lambda item: item.name):
        module = importlib.import_module(f"{protocol.__name__}.{found.name}")
        if body := structs(module, "###"):
            lines += ["", f"## {found.name}", "", (inspect.getdoc(module) or "").split("\n\n")[0], *body]
    return "\n".join(lines)


def settings() -> str:
    """Every key of config.toml."""
    lines = ["# Settings", "", "Keys of `$XDG_CONFIG_HOME/tui-gcs/config.toml`; `TUI_GCS_CONFIG` names another file."]
    lines += ["What is typed comes first, then the environment, then the file, then the default."]
    rows = []
    for key, setting in SETTINGS.items():
        allowed = ", ".join(setting.choices) or {list: "list", str: "text", bool: "true, false", dict: "table"}.get(
            setting.kind, "number"
        )
        variable = f"`{setting.variable}`" if setting.variable else ""
        rows.append((f"`{key}`", cell(allowed), variable, cell(setting.text), setting.counts))
    return "\n".join([*lines, *table(("key", "value", "environment", "meaning", "a change counts"), rows)])


def codes() -> str:
    """The exit codes, and the codes in JSON."""
    lines = ["# Exit codes", ""]
    rows = [
        (f"`{exit_codes.OK}`", "all of it is good: the order is carried out, every check holds"),
        (f"`{exit_codes.FAILED}`", "an order or a check failed, for one vehicle or more"),
        (f"`{exit_codes.CANNOT}`", "the command could not run: one line on stderr says what, where, why"),
        ("`130`", "interrupted by ctrl-c; what the station began goes on"),
    ]
    lines += [
        *table(("code", "meaning"), rows),
        "## Codes in JSON",
        "",
        "The field `code` of [documents that `--json` prints](json.md).",
    ]
    tree = ast.parse(inspect.getsource(exit_codes.ReportCode)).body[0]
    statements = tree.body if isinstance(tree, ast.ClassDef) else []
    rows = []
    for line, after in itertools.pairwise(statements):
        if isinstance(line, ast.Assign) and isinstance(after, ast.Expr):
            rows.append((f"`{ast.literal_eval(line.value) or ' '}`", cell(str(getattr(after.value, "value", "")))))
    return "\n".join([*lines, *table(("code", "meaning"), rows)])


def planner_api() -> str:
    """The page that mkdocstrings fills."""
    return "# Planner interface\n\n::: tui_gcs.planner.api\n"


PAGES: dict[str, Callable[[], str]] = {
    "cli.md": cli,
    "keys.md": keys,
    "alarms.md": alarms,
    "scenario.md": scenario,
    "messages.md": messages,
    "settings.md": settings,
    "exit-codes.md": codes,
    "planner-api.md": planner_api,
}
"""The pages, and what makes them."""


def roff(text: str) -> str:
    """Text of a manual page: nothing in it is a request of roff."""
    return re.sub(r"^([.'])", r"\\&\1", text.replace("\\", "\\e").replace("-", "\\-"), flags=re.MULTILINE)


def manual_page() -> str:
    """The manual page of the whole command line."""
    parser = command_line_parser()
    lines = [f'.TH TUI\\-GCS 1 "" "tui\\-gcs {__version__}" "User Commands"', ".SH NAME"]
    lines += [roff(f"tui-gcs - {(parser.description or '').lower().rstrip('.')}"), ".SH SYNOPSIS"]
    lines += [".B tui\\-gcs", "COMMAND [ARGUMENT ...]", ".SH GENERAL OPTIONS"]
    lines += [part for n, t in arguments_of(parser, True) for part in (".TP", f".B {roff(n)}", roff(t))]
    lines += [".SH COMMANDS"]
    for path, command in commands(parser):
        if path:
            lines += [f".SS tui\\-gcs {roff(' '.join(path))}", roff(" ".join((command.description or "").split()))]
            lines += [part for n, t in arguments_of(command, False) for part in (".TP", f".B {roff(n)}", roff(t))]
            lines += [".PP", ".nf", roff(command.epilog), ".fi"] if command.epilog else []
    lines += [".SH EXIT STATUS"]
    for code, text in ((0, "success"), (1, "an order or a check failed"), (2, "the command could not run")):
        lines += [".TP", f".B {code}", text]
    lines += [
        ".SH FILES",
        ".TP",
        ".I ~/.config/tui\\-gcs/config.toml",
        "settings",
        ".TP",
        ".I ~/.local/state/tui\\-gcs/",
    ]
    return "\n".join([*lines, "logs, keys and states of stations", ""])


SCHEMA = FOLDER / "report.schema.json"


def schema() -> str:
    """The JSON schema of what commands print with `--json`."""
    document = msgspec.json.schema(CommandReport)
    for definition in document["$defs"].values():
        if "properties" in definition:
            definition["required"] = list(definition["properties"])  # defaults are printed, too
            for field in definition["properties"].values():
                field.pop("default", None)
    whole = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "tui-gcs --json", **document}
    return json.dumps(whole, indent=2) + "\n"


def main() -> None:
    """Write the pages, the manual page, or the schema."""
    if "--schema" in sys.argv:
        SCHEMA.write_text(schema(), encoding="utf-8")
        return
    if "--man" in sys.argv:
        (ROOT / "man").mkdir(exist_ok=True)
        (ROOT / "man/tui-gcs.1").write_text(manual_page(), encoding="utf-8")
        return
    FOLDER.mkdir(exist_ok=True)
    for name, make in PAGES.items():
        (FOLDER / name).write_text(make().rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
