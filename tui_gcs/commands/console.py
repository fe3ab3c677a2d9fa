"""Attaching a console to a running station."""

import sys

from tui_gcs.commands.common import join
from tui_gcs.core.kinds import Kind


def attach(kind: Kind) -> int:
    """Show the console until the operator detaches; the station goes on."""
    from tui_gcs.app import ConsoleApp

    bus = join(kind)
    try:
        app = ConsoleApp(bus, kind=kind)
        app.run()
        status = app.feed.status
        armed = status.armed if status is not None and not app.feed.station_lost else 0
        word = f"{armed} vehicles armed" if armed else "nothing armed"
        sys.stdout.write(f"detached; the {kind} station goes on ({word}): tui-gcs attach | status | stop\n")
        return app.return_code or 0
    finally:
        bus.close()
