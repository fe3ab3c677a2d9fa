"""`tui-gcs planner …`: what an author of planners needs."""

import argparse
import importlib

_ACTIONS = {"new": "planner_new", "list": "planner_list", "check": "planner_check", "watch": "planner_watch"}


def run(arguments: argparse.Namespace) -> int:
    """Do it; only what is needed is imported."""
    code: int = importlib.import_module(f"tui_gcs.cli.{_ACTIONS[arguments.what]}").run(arguments)
    return code
