"""`tui-gcs planner …`: what an author of planners needs."""

import argparse
import importlib


def run(arguments: argparse.Namespace) -> int:
    """Do it; only what is needed is imported."""
    code: int = importlib.import_module(f"tui_gcs.cli.planner.{arguments.what}").run(arguments)
    return code
