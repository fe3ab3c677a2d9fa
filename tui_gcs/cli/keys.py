"""`tui-gcs keys …`: the operator's signing keys. Keys come from a prompt or stdin, and are never shown."""

import argparse
import getpass
import secrets
import sys
from collections.abc import Callable

from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.common import join, running
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.mavlink.signing import KEY_BYTES, SigningKey
from tui_gcs.core.signing.key_derivation import Form, secret_from
from tui_gcs.core.signing.keystore import KeyStore, KeyStoreError, check_vehicle, open_store, vehicle_name

ASK_LIMIT_S = 5.0
IDS_PER_NETWORK = 1000


def run(arguments: argparse.Namespace) -> int:
    """Run the action that the arguments name."""
    kind = RunKind(arguments.kind.upper())
    try:
        report = _ACTIONS[arguments.what](open_store(kind), arguments)
    except KeyStoreError as error:
        raise CommandError(str(error)) from None
    return finish(arguments, report)


def _keep(store: KeyStore, arguments: argparse.Namespace) -> CommandReport:
    """Store a key that the operator types, or a random one."""
    form: Form | None = arguments.form
    if arguments.vehicle is not None:
        check_vehicle(arguments.network, arguments.vehicle)
    key = SigningKey(arguments.name, _typed(form) if form else secrets.token_bytes(KEY_BYTES))
    store.add(key)
    text = f"key {key.name} kept, fingerprint {key.fingerprint}"
    _say(text)
    if arguments.vehicle is not None:
        _assign(store, arguments)
    return CommandReport(True, text=text, data={"name": key.name, "fingerprint": key.fingerprint})


def _list(store: KeyStore, arguments: argparse.Namespace) -> CommandReport:
    if not arguments.json:
        _print(store)
    keys = [
        {
            "name": key.name,
            "fingerprint": key.fingerprint,
            "vehicles": [vehicle_name(*vehicle) for vehicle in store.vehicles_of(key.name)],
        }
        for key in store.keys
    ]
    return CommandReport(True, data={"keys": keys})


def _print(store: KeyStore) -> None:
    if not store.keys:
        _say(f"no keys in {store.directory}")
    width = max((len(key.name) for key in store.keys), default=0)
    for key in store.keys:
        vehicles = ", ".join(vehicle_name(*vehicle) for vehicle in store.vehicles_of(key.name))
        _say(f"{key.name:<{width}}  {key.fingerprint}  {f'vehicle {vehicles}' if vehicles else 'no vehicle'}")


def _assign(store: KeyStore, arguments: argparse.Namespace) -> CommandReport:
    store.assign(arguments.name, arguments.network, arguments.vehicle)
    vehicle = vehicle_name(arguments.network, arguments.vehicle)
    return _said(
        f"vehicle {vehicle} must hold key {arguments.name} already: nothing else of it is believed from now on"
    )


def _not_in_flight(arguments: argparse.Namespace, vehicles: list[tuple[str, int]]) -> None:
    """Refuse to remove the key of a vehicle in flight, which would then obey no station. Raises `CommandError`."""
    kind = RunKind(arguments.kind.upper())
    if not vehicles or not running(kind):
        return
    from tui_gcs.cli.station_control import newest

    _, frame = newest(kind)
    flying = {row.id % IDS_PER_NETWORK for row in frame.rows() if row.armed}
    if armed := sorted(system for _, system in vehicles if system in flying):
        ids = ", ".join(map(str, armed))
        raise CommandError(f"vehicle {ids} is armed: without its key it would obey no station. Land it first")


def _unassign(store: KeyStore, arguments: argparse.Namespace) -> CommandReport:
    _not_in_flight(arguments, [(arguments.network, arguments.vehicle)])
    store.unassign(arguments.network, arguments.vehicle)
    return _said(f"vehicle {vehicle_name(arguments.network, arguments.vehicle)}: has no key any more")


def _remove(store: KeyStore, arguments: argparse.Namespace) -> CommandReport:
    key = store.key(arguments.name)
    _not_in_flight(arguments, store.vehicles_of(key.name))
    vehicles = ", ".join(vehicle_name(*vehicle) for vehicle in store.vehicles_of(key.name))
    if vehicles:
        _say(f"Vehicles that hold this key obey no station without it: {vehicles}")
    if _answer(f"Type {key.name} to forget the key {key.fingerprint} for ever: ") != key.name:
        return _said("nothing was removed", ReportCode.CANCELLED)
    store.remove(key.name)
    return _said(f"key {key.name} removed")


def _provision(store: KeyStore, arguments: argparse.Namespace) -> CommandReport:
    """Give a vehicle its key in two steps: the station announces what it will do, and does it for the code it gave."""
    from tui_gcs.core.protocol.bus import BusError
    from tui_gcs.core.protocol.common import ProvisionKey, Reply, decode, encode

    key = store.key(arguments.name)
    kind = RunKind(arguments.kind.upper())
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise CommandError("a vehicle gets its key from a human on a terminal, not from a script")
    if not running(kind):
        raise CommandError(f"no {kind} station runs: the key goes over its link to the vehicle")
    bus = join(kind)

    def ask(confirm: str) -> Reply:
        request = ProvisionKey(vehicle=arguments.vehicle, key=key.name, confirm=confirm)
        return decode(bus.ask("gcs/req/cli", encode(request), timeout_s=ASK_LIMIT_S), Reply)

    try:
        reply = ask("")
        if not reply.ok:
            return _said(reply.text, ReportCode.REFUSED)
        _say(reply.text)
        code = _answer("Type the code to send the key, nothing to leave the vehicle as it is: ").strip()
        if not code:
            return _said("nothing was sent", ReportCode.CANCELLED)
        reply = ask(code)
    except BusError as error:
        raise CommandError(str(error)) from None
    finally:
        bus.close()
    return _said(reply.text, ReportCode.NONE if reply.ok else ReportCode.REFUSED)


def _typed(form: Form) -> bytes:
    """Read a key without echo (a passphrase twice), or from the first line of stdin."""
    what = "64 hex digits of the key" if form == "hex" else "Passphrase"
    if not sys.stdin.isatty():
        return secret_from(sys.stdin.readline().rstrip("\r\n"), form)
    text = getpass.getpass(f"{what}: ")
    if form != "hex" and getpass.getpass("The same again: ") != text:
        raise KeyStoreError("the two differ; nothing was kept")
    return secret_from(text.strip() if form == "hex" else text, form)


def _answer(question: str) -> str:
    """Ask for one line; an end of the input is an empty line."""
    sys.stdout.write(question)
    sys.stdout.flush()
    return sys.stdin.readline().rstrip("\r\n")


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")


def _said(text: str, code: ReportCode = ReportCode.NONE) -> CommandReport:
    """Print the result, and return it for scripts; it is ok without a code."""
    _say(text)
    return CommandReport(not code, code, text)


_ACTIONS: dict[str, Callable[[KeyStore, argparse.Namespace], CommandReport]] = {
    "add": _keep,
    "import": _keep,
    "list": _list,
    "assign": _assign,
    "unassign": _unassign,
    "remove": _remove,
    "provision": _provision,
}
