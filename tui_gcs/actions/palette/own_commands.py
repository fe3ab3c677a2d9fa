"""The operator's own commands in the `:` line: the table `[commands]` of `config.toml`, and lines with arguments.

    [commands]
    low  = "select t1; altitude"
    back = "show fly; select all; return"

Typing `low 20` is the same as typing `select t1; altitude 20`: what is typed behind a command is appended to its words.
A line is one or more steps with `;` between them. A step is the exact name of an action, an order or a screen, with
arguments where it takes some. All steps but the last select vehicles or show a screen, so one line gives at most one
order, which is confirmed as always. Nothing here carries out anything, see `console.command_line`.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from tui_gcs.actions.action import COMMAND
from tui_gcs.actions.orders import ORDERS, VehicleOrder
from tui_gcs.actions.palette.entries import NO_ENTRY, SHOW, Entry, found
from tui_gcs.actions.scopes import SCOPES
from tui_gcs.actions.table import MENU_SCREENS

SELECT_STEP = "select"
"""The step that takes the words of a selection, as `s` does."""
MAX_COMMANDS, MAX_NAME, MAX_WORDS, MAX_STEPS = 100, 16, 200, 8
_NAME = re.compile(rf"[a-z][a-z0-9_-]{{0,{MAX_NAME - 1}}}")
NOT_HERE = "this screen has no such action"
OWN_KEY = "own"
"""What stands in place of a key beside an own command."""


class CommandLineError(ValueError):
    """A line after `:` or a command of the file cannot be carried out; the text is one line for the operator."""

    def __init__(self, text: str, command: str = "") -> None:
        """`command` is the name of the own command with the mistake, if it is one of the file."""
        super().__init__(text)
        self.command = command


@dataclass(frozen=True)
class CommandStep:
    """One step of a line: the name of an entry of the palette in small letters, and what was typed behind it."""

    name: str
    arguments: str = ""

    @property
    def text(self) -> str:
        """The step as it can be typed."""
        return f"{self.name} {self.arguments}".strip()


def _names_of_actions() -> frozenset[str]:
    actions = (action for table in SCOPES.values() for action in table if action.help and action.id not in NO_ENTRY)
    return frozenset(action.id.replace("_", " ") for action in actions)


ORDER_BY_NAME: Mapping[str, VehicleOrder] = {order.name.casefold(): order for order in ORDERS}
ACTION_NAMES = _names_of_actions()
NAMES = ACTION_NAMES | ORDER_BY_NAME.keys()
"""All that a step can name."""
_SHOWS = re.compile(r"show\('([a-z]+)'\)")
SCREEN_MODES: Mapping[str, str] = {
    action.id.replace("_", " "): shows[1]
    for table in SCOPES.values()
    for action in table
    if (shows := _SHOWS.fullmatch(action.method))
}
"""The mode of each action that shows a whole screen; dialogs as `show alarms` are not among them."""


def _found_by_their_beginning() -> frozenset[str]:
    """Return the words that operators type in part: of orders, of commands to the fleet, and of screens."""
    commands = (action.id for table in SCOPES.values() for action in table if action.group == COMMAND)
    screens = (f"{mode} {name}" for _, mode, name, _ in MENU_SCREENS)
    shown = (name for name in ACTION_NAMES if name.startswith(SHOW))
    texts = (*ORDER_BY_NAME, *(name.replace("_", " ") for name in commands), *shown, *screens)
    return frozenset(word for text in texts for word in text.casefold().split())


_WORDS = frozenset(word for name in NAMES for word in name.split())
_BEGUN = _found_by_their_beginning()


class OwnCommands:
    """The operator's own commands by name, checked whole: names hide nothing, and each means something.

    Raises `CommandLineError` when it is made from a table with a mistake; the text begins with the command's name.
    """

    def __init__(self, words: Mapping[str, str] | None = None) -> None:
        """Check `words`: what is typed instead of each name."""
        self.words = words = dict(words or {})
        if len(words) > MAX_COMMANDS:
            raise CommandLineError(f"{len(words)} commands; at most {MAX_COMMANDS} are kept")
        for name, text in words.items():
            if why := _name_problem(name) or _text_problem(text):
                raise CommandLineError(f"{name[:30]!r}: {why}", name)
            try:
                self.steps(name)
            except CommandLineError as error:
                raise CommandLineError(f"{name!r}: {error}", name) from None

    def steps(self, line: str) -> tuple[CommandStep, ...]:
        """Return the steps of a typed line, with own commands replaced by their words. Raises `CommandLineError`."""
        steps = tuple(_step(part) for part in self._parts(line, ()))
        for step in steps[:-1]:
            if step.name not in SCREEN_MODES and not (step.name == SELECT_STEP and step.arguments):
                text = f"{step.text!r} must be the last step: before it only `select …` and screens are possible"
                raise CommandLineError(text)
        return steps

    def _parts(self, line: str, within: tuple[str, ...]) -> list[str]:
        """Return the texts of the steps. `within` are the own commands that are being replaced."""
        parts: list[str] = []
        for part in line.split(";"):
            first, _, rest = part.strip().partition(" ")
            name = first.casefold()
            if name in within:
                raise CommandLineError(f"goes in a circle: {' -> '.join((*within, name))}")
            if name in self.words:
                parts += self._parts(f"{self.words[name]} {rest}".strip(), (*within, name))
            else:
                parts.append(part.strip())
            if len(parts) > MAX_STEPS:
                raise CommandLineError(f"has more than {MAX_STEPS} steps")
        return parts

    def matching(self, entries: Iterable[Entry], typed: str) -> list[Entry]:
        """Return the entries that match what was typed, the likeliest first; see `found`.

        A line that is an own command, or an action with arguments, is an entry of its own before all others. Only names
        of actions that begin with what was typed so far come before arguments. Other own commands come last.
        """
        listed, text = list(entries), typed.strip().casefold()
        matching = found(listed, typed)
        own = found((self._entry(name, listed) for name in self.words if name != text), typed)
        line = self._typed_line(listed, typed)
        if line is None:
            return [*matching, *own]
        begun = [entry for entry in matching if line.key != OWN_KEY and entry.name.casefold().startswith(text)]
        return [*begun, line, *(entry for entry in (*matching, *own) if entry not in begun)]

    def _typed_line(self, entries: list[Entry], typed: str) -> Entry | None:
        """Return the entry of a line with an own command, arguments or several steps; None for a plain name."""
        text = typed.strip()
        first = text.partition(" ")[0].casefold()
        if first in self.words:
            return self._entry(text, entries)
        try:
            steps = self.steps(text)
        except CommandLineError:
            return None  # words that are looked for
        return self._entry(text, entries) if len(steps) > 1 or steps[0].arguments else None

    def _entry(self, line: str, entries: Iterable[Entry]) -> Entry:
        """Return the entry of one line: it shows all of its steps, and why the first can do nothing now."""
        key = OWN_KEY if line.partition(" ")[0].casefold() in self.words else ""
        run = f"app.command_line({line!r})"
        try:
            steps = self.steps(line)
        except CommandLineError as error:
            return Entry(line, key, "", run, str(error))
        first = entry_named(steps[0].name, entries)
        why_not = first.why_not if first is not None else NOT_HERE
        return Entry(line, key, f"= {'; '.join(step.text for step in steps)}", run, why_not)


def entry_named(name: str, entries: Iterable[Entry]) -> Entry | None:
    """Return the first entry with this name in small letters; None where the screen has no such action."""
    return next((entry for entry in entries if entry.name.casefold() == name), None)


def _step(part: str) -> CommandStep:
    """Return the step that a text names: the longest name that it begins with. Raises `CommandLineError`."""
    words = part.split()
    if not words:
        raise CommandLineError("a step is empty")
    for count in range(len(words), 0, -1):
        typed, arguments = " ".join(words[:count]).casefold(), " ".join(words[count:])
        name = typed if typed in NAMES else f"{SHOW}{typed}"
        if name not in NAMES:
            continue
        order = ORDER_BY_NAME.get(name)
        if arguments and name != SELECT_STEP and (order is None or not order.fields):
            raise CommandLineError(f"{typed!r} takes nothing behind it, not {arguments[:30]!r}")
        return CommandStep(name, arguments)
    raise CommandLineError(f"{part[:30]!r} is not the name of an action, an order or a screen: `:` lists them")


def _name_problem(name: str) -> str:
    """Return why an own command cannot have this name; "" if it can."""
    if not _NAME.fullmatch(name):
        return f"a name has small letters, digits, - and _, begins with a letter, and is at most {MAX_NAME} long"
    if name in NAMES or name in _WORDS:
        return "there is such a command already; take another name"
    # `:ret` and `:param` are typed by habit: an own command must not stand in their way.
    if begun := sorted(word for word in _BEGUN if word.startswith(name)):
        return f"finds {begun[0]!r} already; take another name"
    return ""


def _text_problem(text: str) -> str:
    if not text.strip():
        return "has no words"
    if len(text) > MAX_WORDS or not text.isprintable():
        return f"its words must be one line of at most {MAX_WORDS} characters"
    return ""
