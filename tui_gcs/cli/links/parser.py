"""The arguments of `tui-gcs link …` and `tui-gcs forward …`. It imports nothing heavy."""

import argparse

from tui_gcs.cli import options

LINK_EXAMPLES = """tui-gcs link list                                     what goes over each link
tui-gcs link add udpin:0.0.0.0:14551,network=north    one more, as --link takes it
tui-gcs link rate serial:/dev/ttyUSB0:57600 4000      bytes a second; the vehicles' messages follow
tui-gcs link close udpin:0.0.0.0:14551                refused while an armed vehicle is heard over it alone

In LIVE an added link is opened by later stations, too, until it is closed; in SIM it ends with the station."""
FORWARD_EXAMPLES = """tui-gcs forward add udpout:192.168.1.5:14550              QGroundControl there hears the vehicles
tui-gcs forward add udpout:192.168.1.5:14550 --commands   and may command them: each command is judged
tui-gcs forward list                                      who hears the vehicles, and what of them was refused
tui-gcs forward close udpout:192.168.1.5:14550

In LIVE later stations forward there, too, until it is closed; the permission to command ends with this station."""
ADDRESS = "udpin:HOST:PORT, udpout:…, tcp:…, tcpin:… or serial:DEVICE:BAUD"


def add(commands: options.Commands) -> None:
    """Add the commands `link` and `forward` to the parser."""
    text = "links of the running station: list, add, close, say what one carries"
    link = options.command(commands, "link", text, examples=LINK_EXAMPLES)
    actions = link.add_subparsers(title="actions", required=True, metavar="ACTION", dest="what")
    _action(actions, "link", "list", "each link, its traffic and its vehicles")
    added = _action(actions, "link", "add", "open another link, or one that was closed")
    known = f"{ADDRESS}, with ,network=NAME ,secure ,highlatency ,rate=BYTES_PER_S"
    added.add_argument("address", metavar="LINK", help=known)
    rated = _action(actions, "link", "rate", "how many bytes a second a link carries, both directions together")
    rated.add_argument("address", metavar="LINK", help="its name, as `list` shows it")
    rated.add_argument("bytes_per_s", metavar="BYTES", help="bytes a second, or none: no limit")
    closed = _action(actions, "link", "close", "close a link")
    closed.add_argument("address", metavar="LINK", help="its name, as `list` shows it")

    text = "other stations that hear the vehicles of the running station: list, add, close"
    forward = options.command(commands, "forward", text, examples=FORWARD_EXAMPLES)
    actions = forward.add_subparsers(title="actions", required=True, metavar="ACTION", dest="what")
    _action(actions, "forward", "list", "each partner, what reached vehicles of it, and what was refused")
    added = _action(actions, "forward", "add", "forward to another station from now on")
    added.add_argument("address", metavar="LINK", help=f"{ADDRESS}, with ,network=NAME where system ids repeat")
    known = "take its commands, too: each is judged and journalled"
    added.add_argument("--commands", action="store_true", help=known)
    closed = _action(actions, "forward", "close", "forward there no longer, and take nothing from there")
    closed.add_argument("address", metavar="LINK", help="its name, as `list` shows it")


def _action(actions: options.Commands, subject: str, name: str, text: str) -> argparse.ArgumentParser:
    parser = options.command(actions, name, text)
    parser.set_defaults(module="links.verbs", subject=subject)
    options.report(parser)
    parser.add_argument("--kind", choices=("sim", "live"), help="which station, where both run")
    return parser
