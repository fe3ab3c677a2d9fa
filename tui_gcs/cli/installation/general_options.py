"""The options that every command takes: `-v`, `-q`, `--no-color`. It imports nothing heavy.

They are handed on as environment variables, as those of consoles are.
"""

import argparse
from collections.abc import Iterator, Mapping, MutableMapping

VERBOSE, QUIET, NO_COLOR = "TUI_GCS_VERBOSE", "TUI_GCS_QUIET", "NO_COLOR"
"""Their variables; `NO_COLOR` is that of no-color.org, which any value but an empty one sets."""


def commands(
    parser: argparse.ArgumentParser, path: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], argparse.ArgumentParser]]:
    """Yield every command below a parser, and the parser itself: its words and its own parser, in order."""
    yield path, parser
    for action in parser._actions:  # argparse has no public way to look at what was added
        if isinstance(action, argparse._SubParsersAction):
            for name, child in action.choices.items():
                yield from commands(child, (*path, name))


def add(parser: argparse.ArgumentParser) -> None:
    """Add the options to a parser and to all of its commands, so that they may stand anywhere on the line."""
    for _, command in commands(parser):
        group = command.add_argument_group("general options")
        # SUPPRESS: the default of a subcommand would overwrite what was given before it.
        known = "say also which settings are used, and where an error comes from"
        group.add_argument("-v", "--verbose", action="store_true", default=argparse.SUPPRESS, help=known)
        known = "no progress and no remarks; results, warnings and errors are still shown"
        group.add_argument("-q", "--quiet", action="store_true", default=argparse.SUPPRESS, help=known)
        known = "without colours (also: NO_COLOR=1)"
        group.add_argument("--no-color", action="store_true", default=argparse.SUPPRESS, help=known)


def apply(arguments: argparse.Namespace, environ: MutableMapping[str, str]) -> None:
    """Put the options that were given into the environment."""
    for name, variable in (("verbose", VERBOSE), ("quiet", QUIET), ("no_color", NO_COLOR)):
        if getattr(arguments, name, False):
            environ[variable] = "1"


def is_set(name: str, environ: Mapping[str, str]) -> bool:
    """Return whether a variable of ours is set: to anything but nothing and 0."""
    return environ.get(name, "") not in ("", "0")
