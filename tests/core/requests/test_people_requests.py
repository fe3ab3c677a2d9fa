"""Who is connected, who holds control, and how it changes hands."""

import math
from collections.abc import Callable

import msgspec

from tests.core.rigs.rig import Rig
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.bus import ALIVE, REQUEST
from tui_gcs.core.protocol.people import GetPeople, HandOver, PersonRow, TakeControl

MakeRig = Callable[..., Rig]


def ask(rig: Rig, request: m.Request, principal: str = "console-1") -> s.ServiceReply:
    answer = rig.bus.ask(REQUEST.format(principal=principal), m.encode(request))
    return msgspec.msgpack.decode(answer, type=s.ServiceReply)


def people(rig: Rig) -> dict[str, PersonRow]:
    return {row.principal: row for row in ask(rig, GetPeople()).people}


def test_who_is_connected_is_known_as_it_comes_and_goes(rig: MakeRig) -> None:
    ground = rig(1)
    token = ground.bus.alive(ALIVE.format(principal="console-1"))
    row = people(ground)["console-1"]
    assert row.is_present and not row.is_in_control and math.isnan(row.last_command_age_s)
    token.close()
    assert "console-1" not in people(ground)


def test_who_commanded_is_in_control_and_stays_listed_when_it_is_gone(rig: MakeRig) -> None:
    ground = rig(1)
    assert ask(ground, m.SwitchRound(index=1), "cli-4").ok
    row = people(ground)["cli-4"]
    assert (row.is_present, row.is_in_control, row.last_command) == (False, True, "switch round")


def test_control_is_handed_over_by_its_holder_to_who_is_connected(rig: MakeRig) -> None:
    ground = rig(1)
    ground.bus.alive(ALIVE.format(principal="console-2"))
    assert ask(ground, TakeControl(), "console-1").ok
    assert "is not connected" in ask(ground, HandOver("console-9")).text
    assert "only its holder" in ask(ground, HandOver("console-2"), "console-3").text
    assert people(ground)["console-1"].is_in_control
    assert ask(ground, HandOver("console-2")).ok
    assert people(ground)["console-2"].is_in_control
    assert any("hands control over to console-2" in event.text for event in ground.events())


def test_a_planner_worker_never_holds_control(rig: MakeRig) -> None:
    ground = rig(1)
    ground.bus.alive(ALIVE.format(principal="planner-defend"))
    assert "may not command" in ask(ground, HandOver("planner-defend")).text
    assert not ask(ground, TakeControl(), "planner-defend").ok
    assert not any(row.is_in_control for row in people(ground).values())
