"""Attaching a console to a running station."""

from tui_gcs.commands.common import join
from tui_gcs.core.kinds import Kind


def attach(kind: Kind) -> int:
    """Show the console until the operator detaches; the station goes on."""
    from tui_gcs.app import ConsoleApp

    bus = join(kind)
    try:
        app = ConsoleApp(bus, kind=kind)
        app.run()
        return app.return_code or 0
    finally:
        bus.close()
