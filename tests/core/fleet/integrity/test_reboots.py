"""Reboots are noticed once, and nothing else is taken for one: the whole station in lock-step."""

from tests.core.rigs.wires import LOST_TEXT, MakeWired, Wire
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase


def test_a_reboot_is_noticed_within_two_seconds_and_everything_is_asked_again_once(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near")]).run(30.0)
    vehicle = flight.vehicle()
    vehicle.telemetry.prearm_ok, vehicle.telemetry.home_m = True, (1.0, 2.0, 0.0)
    flight.sim._pilots[0].restart(flight.sim._now_us)
    flight.run(0.1)
    last_heard_s = vehicle.telemetry.heartbeat_s
    flight.until(lambda: vehicle.telemetry.heartbeat_s > last_heard_s, 5.0, "heard again")
    since_s = flight.clock.now()
    flight.until(lambda: vehicle.integrity.reboots == 1, 2.0, "reboot noticed")
    assert not vehicle.telemetry.prearm_ok and vehicle.telemetry.home_m is None and vehicle.telemetry.satellites == -1
    assert not vehicle.identity.identified and not vehicle.telemetry.has_battery_status
    flight.until(
        lambda: vehicle.identity.identified and flight.clock.now() - vehicle.telemetry.position_s < 0.5,
        8.0,
        "in order again",
    )
    flight.run(30.0)
    assert vehicle.integrity.reboots == 1 and flight.texts("vehicle 1").count("rebooted") == 1
    intervals = [f["param1"] for t, f in flight.sent_to(1, "COMMAND_LONG", since_s) if f["command"] == 511]
    assert len(intervals) >= 4 and len(set(intervals)) == len(intervals)


def test_a_reboot_on_two_links_is_one(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near"), Wire("far", delay_s=0.8)]).run(30.0)
    flight.sim._pilots[0].restart(flight.sim._now_us)
    flight.run(30.0)
    assert flight.vehicle().integrity.reboots == 1 and not flight.vehicle().why_not_commanded
    assert len(flight.vehicle().used_paths()) == 2


def test_a_start_under_way_ends_when_the_vehicle_reboots(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near")]).ready()
    flight.until(lambda: not flight.station.frontend.readiness.why_not_start(1), 60.0)
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.sim._pilots[0].restart(flight.sim._now_us)
    flight.run(40.0)
    assert flight.phase(1) is Phase.GROUND and not flight.sim.armed.any()
    assert any("not started" in text for text in flight.texts("vehicle 1"))


def test_a_start_under_way_ends_when_a_boot_clock_begins_anew(wired: MakeWired) -> None:
    flight = wired(1, wires=[Wire("near")]).ready()
    flight.until(lambda: not flight.station.frontend.readiness.why_not_start(1), 60.0)
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.sim.silence(0)
    fields = {"lat": 1, "lon": 1, "alt": 0, "relative_alt": 0, "vx": 0, "vy": 0, "vz": 0, "hdg": 0}
    flight.wires[0].link.inject(flight.outgoing.encode("GLOBAL_POSITION_INT", time_boot_ms=300, **fields), ("sim", 0))
    flight.run(0.1)
    assert "not started: rebooted" in flight.texts("vehicle 1")


def test_swapped_neighbours_are_no_loss_and_no_doubt(wired: MakeWired) -> None:
    """PX4's two sending threads swap neighbours all the time."""
    held: list[bytes] = []
    wire = Wire("near")
    plain = wire.from_vehicle

    def swapping(now: float, data: bytes, address: Address) -> None:
        held.append(data)
        if len(held) == 2:
            for each in reversed(held):
                plain(now, each, address)
            held.clear()

    wire.from_vehicle = swapping  # type: ignore[method-assign]
    flight = wired(1, wires=[wire]).run(20.0)
    since_s = flight.clock.now()
    flight.run(60.0)
    assert flight.vehicle().loss_pct < 1.0
    assert flight.vehicle().integrity.reboots == 0 and not flight.vehicle().identity.blocked
    assert 512 not in flight.commands(wire, since_s)


def test_loss_and_a_second_of_jitter_are_no_twin_no_reboot_and_no_loss_of_contact(wired: MakeWired) -> None:
    import random

    chance = random.Random(5)
    wire = Wire("near", loses=lambda way, data: chance.random() < 0.2)
    plain, held = wire.from_vehicle, list[tuple[float, bytes, Address]]()

    def shaken(now: float, data: bytes, address: Address) -> None:
        held.append((now + chance.uniform(0.0, 1.0), data, address))
        for due in sorted(each for each in held if each[0] <= now):
            held.remove(due)
            plain(now, due[1], due[2])

    wire.from_vehicle = shaken  # type: ignore[method-assign]
    flight = wired(1, wires=[wire]).run(300.0)
    assert not flight.vehicle().identity.blocked and flight.vehicle().integrity.reboots == 0
    assert not any(LOST_TEXT in text or "DUPLICATE" in text for text in flight.texts())
    assert flight.commands(wire).count(512) <= 60
