"""Modes, and orders that a vehicle does not know, does not take, or that are not for it."""

from tests.conformance.field import Failed, Field
from tests.conformance.pilot import Pilot, flying
from tests.conformance.report import check
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass

NO_COMMAND = 31_999
"""MAV_CMD_USER_5 is 31014, the last one of common.xml's ranges below 32000 that anybody uses."""
REQUEST_MESSAGE, AUTOPILOT_VERSION = 512, 148
NOBODY = 251
OWN_SYSTEM, OWN_COMPONENT = 255, 190
LISTEN_S = 3.0


@check("modes: named and listed", takes_s=6.0)
def modes(field: Field, vehicle: int) -> str:
    """The vehicle's modes have names, those of a return and a landing among them."""
    v = field.vehicle(vehicle)
    service = field.station.services.modes
    service.want(v)
    field.run(5.0)
    names = [mode.name for mode in service.list(v)]
    unknown = [word for word in ("rtl", "land") if service.number(v, word) is None]
    if not names or unknown:
        raise Failed(f"{len(names)} modes; no word for {', '.join(unknown)}")
    return f"{len(names)}: {', '.join(names[:6])} …"


@check("orders: an unknown command")
def unknown_command(field: Field, vehicle: int) -> str:
    """A command that does not exist is refused as unsupported, not waited for."""
    outcome, why, took_s = Pilot(field, vehicle).asked("no such command", MavCommand(NO_COMMAND))
    if outcome is not Outcome.REFUSED or "unsupported" not in why:
        raise Failed(f"command {NO_COMMAND}: {outcome.value} ({why}), expected: refused (unsupported)")
    return f"command {NO_COMMAND}: {outcome.value} ({why}) after {took_s:.2f} s"


@check("orders: for a system that does not exist")
def nobody(field: Field, vehicle: int) -> str:
    """To an id that nobody has: the station sends nothing and says so; on the wire this vehicle does not answer it."""
    v, station = field.vehicle(vehicle), field.station
    ended: list[Outcome] = []
    order = MavCommand(REQUEST_MESSAGE, (AUTOPILOT_VERSION,))
    action = station.comms.command_encoder.action(
        NOBODY, f"version for {vehicle}", RetryClass.START, order, None, lambda _, outcome, __: ended.append(outcome)
    )
    station.comms.commands.submit(action)
    answers: list[int] = []

    def heard(who: object, fields: dict[str, int]) -> None:
        if who is v and fields["command"] == REQUEST_MESSAGE and fields.get("target_component") == OWN_COMPONENT - 1:
            answers.append(fields["result"])

    station.picture.fleet.on_message("COMMAND_ACK", heard)
    encoder = Encoder(OWN_SYSTEM, OWN_COMPONENT - 1)  # another component of ours: whose answer it is, is plain
    for _ in range(3):
        field.air.send(
            encoder.encode("COMMAND_LONG", target_system=NOBODY, target_component=1, **order.fields(0)), v.address
        )
        field.run(LISTEN_S / 3)
    field.until(lambda: bool(ended), 20.0, f"an end of what was asked of system {NOBODY}")
    if ended[0] is Outcome.CONFIRMED or answers:
        raise Failed(f"system {NOBODY}: {ended[0].value}; vehicle {vehicle} answered {len(answers)} times")
    return f"the station: {ended[0].value}; the vehicle did not answer what is for system {NOBODY}"


@check("refusal: a mode it cannot fly", takes_s=70.0)
def mode_refused(field: Field, vehicle: int) -> str:
    """In the air: a mission mode without a mission, OFFBOARD without a stream. It stays, and says why."""
    with flying(field, vehicle) as pilot:
        v, services = pilot.vehicle, field.station.services
        word = next((w for w in ("offboard", "auto") if services.modes.number(v, w) is not None), None)
        if word is None:
            raise Failed("no word for a mode that has to be refused")
        number = services.modes.number(v, word)
        assert number is not None
        outcome, why, took_s = pilot.order(pilot.firmware.mode(v, number, f"mode {word}", RetryClass.SET))
        field.run(2.0)
        if outcome is Outcome.CONFIRMED or v.telemetry.custom_mode == number or not why:
            raise Failed(f"{word}: {outcome.value} ({why or 'no reason'}), now in {pilot.mode}")
    return f"{word}: {outcome.value} after {took_s:.2f} s ({why})"
