"""Asking a `ServiceRig` as a command line would, and a vehicle that does what it is told."""

from tests.core.rigs.service_rig import PX4, Fields, Peer, ServiceRig
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.bus import REQUEST
from tui_gcs.core.requests.links.link_requests import LinkRequests


def ask(rig: ServiceRig, request: m.Request, principal: str = "cli") -> s.ServiceReply:
    return m.decode(rig.bus.ask(REQUEST.format(principal=principal), m.encode(request)), s.ServiceReply)


def task(rig: ServiceRig, number: int) -> s.TaskInfo:
    return ask(rig, s.GetTasks((number,))).tasks[0]


def ended(rig: ServiceRig, request: m.Request, limit_s: float = 20.0) -> tuple[s.TaskInfo, s.TaskResult | None]:
    """Ask, let time pass until its one task is over; how that ended."""
    reply = ask(rig, request)
    assert reply.ok, reply
    number = reply.tasks[0].number
    rig.until(lambda: task(rig, number).over, limit_s, "the task is over")
    return task(rig, number), ask(rig, s.GetTaskResult(number)).result


def refusal(rig: ServiceRig, request: m.Request, principal: str = "cli") -> str:
    """Why nothing is done for the one vehicle that is named; nothing leaves."""
    reply = ask(rig, request, principal)
    assert not reply.ok and not reply.tasks
    return reply.results[0].text if reply.results else reply.text


def takes_modes(peer: Peer, fields: Fields) -> None:
    """A vehicle that obeys DO_SET_MODE and reboots."""
    if fields["command"] == 176:
        px4 = int(fields["param2"]) << 16 | int(fields["param3"]) << 24
        peer.custom_mode = px4 if peer.autopilot == PX4 else int(fields["param2"])
        peer.ack(176)
    elif fields["command"] in (511, 512):
        peer.ack(fields["command"])


def obedient(system: int = 1, **traits: object) -> Peer:
    return Peer(system, answers={"COMMAND_LONG": takes_modes}, **traits)  # type: ignore[arg-type]


def answer_text(requests: LinkRequests, request: m.Request) -> str:
    """What a console is answered by the handler itself, without a bus."""
    return requests.handlers()[type(request)].answer("console-1", request).text
