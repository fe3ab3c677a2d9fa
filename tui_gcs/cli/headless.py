"""`tui-gcs demo --headless`: the whole flight in lock-step, and its result as a table."""

import argparse

from tui_gcs.cli.common import check_writable
from tui_gcs.cli.lock_step_run import read_request
from tui_gcs.cli.result_table import report


def fly(arguments: argparse.Namespace) -> int:
    """Fly, print the table and write the JSON. The exit code is 0 only if every check holds."""
    check_writable(arguments.json)
    flight = read_request(arguments, "headless")
    code = report(*flight.fly(), arguments.json)
    flight.tell_links()
    flight.bound_folders()
    return code
