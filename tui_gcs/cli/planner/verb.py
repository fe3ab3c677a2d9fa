"""`tui-gcs planner …`: the commands for authors of planners."""

import argparse
import importlib


def run(arguments: argparse.Namespace) -> int:
    """Run the action; only the module that it needs is imported."""
    code: int = importlib.import_module(f"tui_gcs.cli.planner.{arguments.what}").run(arguments)
    return code
