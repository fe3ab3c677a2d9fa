"""`tui-gcs completion SHELL`: prints a script with which a shell completes commands, options and files."""

import argparse
import sys

from tui_gcs.cli.installation.general_options import commands

SHELLS = ("bash", "zsh", "fish")


def run(arguments: argparse.Namespace) -> int:
    """Print the script that shtab makes of `arguments.whole`, the parser of the whole command line."""
    import shtab

    parser: argparse.ArgumentParser = arguments.whole
    for _, command in commands(parser):
        for action in command._actions:
            if "FILE" in str(action.metavar) or "PATH" in str(action.metavar) or ".toml" in str(action.metavar):
                setattr(action, "complete", shtab.FILE)  # noqa: B010 - argparse's type has no such attribute; shtab looks for it
    sys.stdout.write(shtab.complete(parser, arguments.shell).rstrip() + "\n")
    return 0
