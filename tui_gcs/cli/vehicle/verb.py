"""`tui-gcs vehicle …`: everything that can be done with vehicles by name, through the running station."""

import argparse
import importlib
import os
import sys

from tui_gcs.cli.vehicle.station_client import open_station
from tui_gcs.console.exits import FAILED

_ACTIONS = {
    "list": "vehicle_show.run_list",
    "show": "vehicle_show.run_show",
    "failsafes": "vehicle_show.run_failsafes",
    "events": "vehicle_show.run_events",
    "tasks": "vehicle_show.run_tasks",
    "cancel": "vehicle_show.run_cancel",
    "params": "vehicle_params.run",
    "plan": "vehicle_plan.run",
    "files": "vehicle_files.run_files",
    "logs": "vehicle_files.run_logs",
    "mode": "vehicle_acts.run_mode",
    "shell": "vehicle_acts.run_shell",
    "reboot": "vehicle_acts.run_reboot",
    "calibrate": "vehicle_calibrate.run",
    "tune": "vehicle_setup.run_tune",
    "airframe": "vehicle_setup.run_airframe",
    "motor-test": "vehicle_setup.run_motor_test",
    "gimbal": "vehicle_carry.run_gimbal",
    "camera": "vehicle_carry.run_camera",
    "roi": "vehicle_carry.run_roi",
    "traffic": "vehicle_carry.run_traffic",
    "remote-id": "vehicle_carry.run_remote_id",
}
"""Module and function; only what is needed is imported."""


def run(arguments: argparse.Namespace) -> int:
    """Find the station meant, and do it."""
    module, _, function = _ACTIONS[arguments.what].partition(".")
    act = getattr(importlib.import_module(f"tui_gcs.cli.{module}"), function)
    station = open_station(arguments.station)
    try:
        code: int = act(station, arguments)
        return code
    except BrokenPipeError:  # whoever read it has seen enough, e.g. `head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    finally:
        station.close()
