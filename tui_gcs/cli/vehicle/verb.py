"""`tui-gcs vehicle …`: everything that can be done with vehicles by number, through the running station."""

import argparse
import importlib

from tui_gcs.cli.vehicle.station_client import open_station

_ACTIONS = {
    "list": "show.run_list",
    "show": "show.run_show",
    "failsafes": "show.run_failsafes",
    "events": "show.run_events",
    "tasks": "show.run_tasks",
    "cancel": "show.run_cancel",
    "params": "params.run",
    "plan": "plan.run",
    "files": "files.run_files",
    "logs": "files.run_logs",
    "mode": "mode_shell_reboot.run_mode",
    "shell": "mode_shell_reboot.run_shell",
    "reboot": "mode_shell_reboot.run_reboot",
    "calibrate": "calibrate.run",
    "tune": "setup.run_tune",
    "airframe": "setup.run_airframe",
    "motor-test": "setup.run_motor_test",
    "gimbal": "payload.run_gimbal",
    "camera": "payload.run_camera",
    "roi": "payload.run_roi",
    "traffic": "payload.run_traffic",
    "remote-id": "payload.run_remote_id",
}
"""The module and function of each action; only the module that is needed is imported."""


def run(arguments: argparse.Namespace) -> int:
    """Find the station that the arguments name and run the action."""
    module, _, function = _ACTIONS[arguments.what].partition(".")
    act = getattr(importlib.import_module(f"tui_gcs.cli.vehicle.{module}"), function)
    station = open_station(arguments.station)
    try:
        code: int = act(station, arguments)
        return code
    finally:
        station.close()
