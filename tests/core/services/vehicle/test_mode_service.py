"""Modes by name: from the vehicle's own list where it has one, else from tables; asked for only when wanted."""

from pathlib import Path

import pytest

from tests.core.rigs.service_rig import PX4, Fields, Peer, ServiceRig
from tui_gcs.core.mavlink.mode_names import known_modes, mode_name
from tui_gcs.core.services.vehicle.mode_service import ModeService

COPTER_LIST = [
    (27, "AUTO RTL"),
    (3, "AUTO"),
    (0, "STABILIZE"),
    (4, "GUIDED"),
    (6, "RTL"),
    (21, "SMARTRTL"),
    (99, "MINE"),
]
"""As ArduCopter lists them, shortened; 99 is a scripted one."""
PX4_LIST = [
    (0x10000, 0, 0, "Manual"),
    (0x30000, 1, 0, ""),
    (0x1030000, 2, 0, ""),
    (0x3040000, 0, 0, "Hold"),
    (0x5040000, 5, 0, ""),
    (0xB040000, 0, 0, "Follow my lead"),
    (0xC040000, 0, 2, "(Mode not available)"),
]


def say_mode(peer: Peer, index: int, total: int, number: int, standard: int, properties: int, name: str) -> None:
    peer.say(
        "AVAILABLE_MODES",
        number_modes=total,
        mode_index=index,
        custom_mode=number,
        standard_mode=standard,
        properties=properties,
        mode_name=name,
    )


def one_by_one(peer: Peer, fields: Fields) -> None:
    """ArduPilot: index 0 brings index 1; beyond the end an ACK and no message."""
    if fields["command"] == 512 and fields["param1"] == 435:
        index = max(1, int(fields["param2"]))
        peer.ack(512)
        if index <= len(COPTER_LIST):
            number, name = COPTER_LIST[index - 1]
            say_mode(peer, index, len(COPTER_LIST), number, 0, 0, name)
    elif fields["command"] in (511, 512):
        peer.ack(fields["command"])


def all_at_once(peer: Peer, fields: Fields) -> None:
    """PX4."""
    if fields["command"] == 512 and fields["param1"] == 435:
        for index, (number, standard, properties, name) in enumerate(PX4_LIST, start=1):
            if int(fields["param2"]) in (0, index):
                say_mode(peer, index, len(PX4_LIST), number, standard, properties, name)
        peer.ack(512)


def ask_count(peer: Peer) -> int:
    return sum(1 for f in peer.got("COMMAND_LONG") if f["command"] == 512 and f["param1"] == 435)


def loaded(tmp_path: Path, peer: Peer, **trouble: float) -> tuple[ServiceRig, ModeService]:
    rig = ServiceRig(tmp_path, peer, **trouble).heard()
    modes = rig.station.services.modes
    modes.want(rig.vehicle())
    rig.run(20.0 if trouble else 5.0)
    return rig, modes


@pytest.mark.parametrize(
    ("autopilot", "kind", "number", "name"),
    [
        (3, 2, 4, "GUIDED"),
        (3, 1, 15, "GUIDED"),
        (3, 10, 4, "HOLD"),
        (3, 12, 19, "MANUAL"),
        (3, 12, 9, "SURFACE"),
        (12, 2, 0x3040000, "HOLD"),
        (12, 2, 0x60000, "OFFBOARD"),
        (12, 2, 0x1030000, "ORBIT"),
        (3, 2, 99, "mode 99"),
        (8, 99, 5, "mode 5"),
    ],
)
def test_the_tables_know_both_autopilots(autopilot: int, kind: int, number: int, name: str) -> None:
    assert mode_name(autopilot, kind, number) == name
    assert known_modes(autopilot, kind).get(number, name) == name


def test_no_vehicle_is_asked_for_modes_before_they_are_needed(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1), Peer(2)).heard().run(10.0)
    assert sum(ask_count(peer) for peer in rig.peers.values()) == 0
    modes = rig.station.services.modes
    assert modes.number(rig.vehicle(), "guided") == 4
    assert modes.number(rig.vehicle(), "smart rtl") == modes.number(rig.vehicle(), "SMART_RTL") == 21
    assert modes.number(rig.vehicle(), "hold") is None, "ArduCopter has none of that name"
    assert modes.name(rig.vehicle()) == "STABILIZE"


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_ardupilot_lists_its_modes_index_by_index(tmp_path: Path, loss: float) -> None:
    peer = Peer(1, answers={"COMMAND_LONG": one_by_one})
    rig, modes = loaded(tmp_path, peer, **({"loss": loss} if loss else {}))
    vehicle = rig.vehicle()
    assert [mode.number for mode in modes.list(vehicle)] == [number for number, _ in COPTER_LIST]
    assert [mode.name for mode in modes.list(vehicle)][-2:] == ["SMART_RTL", "MINE"], "our word where we have one"
    assert modes.number(vehicle, "mine") == 99
    assert modes.number(vehicle, "smartrtl") == 21
    assert modes.number(vehicle, "loiter") is None, "it lists no such mode"
    if not loss:
        assert ask_count(peer) == len(COPTER_LIST)


def test_px4_lists_all_at_once_and_names_come_from_standard_modes(tmp_path: Path) -> None:
    peer = Peer(1, autopilot=PX4, answers={"COMMAND_LONG": all_at_once})
    rig, modes = loaded(tmp_path, peer)
    vehicle = rig.vehicle()
    assert [(mode.number, mode.name) for mode in modes.list(vehicle)] == [
        (0x10000, "MANUAL"),
        (0x30000, "POSCTL"),
        (0x1030000, "ORBIT"),
        (0x3040000, "HOLD"),
        (0x5040000, "RTL"),
        (0xB040000, "Follow my lead"),
    ]
    assert ask_count(peer) == 1
    for word in ("hold", "Hold", "loiter", "LOITER"):
        assert modes.number(vehicle, word) == 0x3040000
    assert modes.number(vehicle, "position hold") == modes.number(vehicle, "position") == 0x30000
    assert modes.number(vehicle, "follow my lead") == 0xB040000
    assert modes.number(vehicle, "(Mode not available)") is None
    assert modes.name(vehicle, 0xB040000) == "Follow my lead"


def test_who_has_no_list_is_asked_once_and_the_tables_serve(tmp_path: Path) -> None:
    def no(peer: Peer, fields: Fields) -> None:
        peer.ack(fields["command"], 3)

    rig, modes = loaded(tmp_path, Peer(1, type=12, answers={"COMMAND_LONG": no}))
    asked = ask_count(rig.peers[1])
    modes.want(rig.vehicle())
    rig.run(5.0)
    assert ask_count(rig.peers[1]) == asked <= 5
    assert modes.number(rig.vehicle(), "surface") == 9


def test_a_changed_monitor_has_the_list_read_again(tmp_path: Path) -> None:
    peer = Peer(1, autopilot=PX4, answers={"COMMAND_LONG": all_at_once})
    rig, modes = loaded(tmp_path, peer)
    for seq, asked in ((0, 1), (0, 1), (1, 2)):
        peer.say("AVAILABLE_MODES_MONITOR", seq=seq)
        rig.run(2.0)
        assert ask_count(peer) == asked
    assert len(modes.list(rig.vehicle())) == 6


def test_unasked_and_impossible_lists_are_ignored(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    modes = rig.station.services.modes
    say_mode(rig.peers[1], 1, 1, 4, 0, 0, "EVIL")
    rig.run(0.1)
    assert modes.ignored["modes not requested"] == 1 and modes.name(rig.vehicle(), 4) == "GUIDED"
    modes.want(rig.vehicle())
    for index in (0, 200, 255):
        say_mode(rig.peers[1], index, 255 if index else 7, 4, 0, 0, "EVIL")
    rig.run(0.1)
    assert modes.ignored["mode beyond the number of modes"] == 3


def test_a_reboot_forgets_the_list(tmp_path: Path) -> None:
    peer = Peer(1, autopilot=PX4, answers={"COMMAND_LONG": all_at_once})
    rig, modes = loaded(tmp_path, peer)
    assert modes.number(rig.vehicle(), "follow my lead")
    for listener in rig.station.picture.fleet.paths.on_reboot:
        listener(rig.vehicle())
    assert modes.number(rig.vehicle(), "follow my lead") is None
