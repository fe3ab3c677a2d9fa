"""Runs a planner once on each vehicle of a team: a planner like any other for hosts, made of one instance per vehicle.

Each instance sees its own vehicle, the neighbours that it hears, and the targets that its own sensors detect. All of
them run in the team's one worker, one after the other, in the order of ids; what one sends, others get in the next step
at the soonest. So their order does not matter, and the same seed gives the same flight.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, ClassVar

import msgspec
import numpy as np

from tui_gcs.core.protocol.base import Message
from tui_gcs.core.protocol.common import PlannerTask
from tui_gcs.core.protocol.plan_limits import MAX_METRICS
from tui_gcs.planner.api import Context, Event, Fleet, Output, ParamValue, Planner, Radio, Received, Tracks
from tui_gcs.planner.runtime.message_conversion import class_columns, read_only
from tui_gcs.planner.runtime.message_network import Beacon, MessageInFlight, MessageNetwork, NetworkState
from tui_gcs.planner.runtime.vehicle_instance import InstanceState, VehicleInstance, decoded

HOST_METRICS = ("messages_sent", "messages_delivered", "messages_lost", "messages_dropped", "instances_failed")


FORM = "_per_vehicle_form"


class TeamState(Message, frozen=True):
    """A snapshot of all instances and of the network between them. Field names are stored in snapshots."""

    network: NetworkState
    instances: dict[int, InstanceState]
    sent: int
    unreadable: int


def hosted(kind: type[Planner], task: PlannerTask) -> type[Planner]:
    """Return the class that a host runs for this planner and task: itself, or one with an instance per vehicle."""
    return per_vehicle(kind) if (task.instances or kind.instances) == "per_vehicle" else kind


def per_vehicle(kind: type[Planner]) -> type[Planner]:
    """Return a planner class that runs `kind` once on each vehicle; the same one for the same `kind`."""
    made: type[Planner] | None = vars(kind).get(FORM)
    if made is not None:
        return made
    body = {
        "kind": kind,
        "name": kind.name,
        # A snapshot of the planner in the other form is of no use to this one.
        "version": f"{kind.version} per vehicle",
        "params": kind.params,
        "rate_hz": kind.rate_hz,
        "iterations_per_s": kind.iterations_per_s,
        "metrics": kind.metrics,
        "judged_by": kind.judged_by,
        "ids_matter": kind.ids_matter,
        "__module__": kind.__module__,
    }
    made = type(kind.__name__, (_PerVehicle,), body)
    # Kept on the class itself: a watched file defines a new class with every version, and old ones are to go.
    setattr(kind, FORM, made)
    return made


class _PerVehicle(Planner):
    """One planner instance on each vehicle, with the network between them."""

    kind: ClassVar[type[Planner]]

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        """Configure all instances. Raises what the first one raises if none can be configured."""
        super().configure(task, params, rng)
        seed = int(rng.integers(2**63))
        self._network = MessageNetwork(task.communication, np.random.default_rng([seed, 0]))
        self._instances = {
            vehicle: VehicleInstance(
                self.kind,
                msgspec.structs.replace(task, vehicle=vehicle),
                params,
                np.random.default_rng([seed, vehicle]),
                Radio(task.members, task.communication),
            )
            for vehicle in sorted(task.members)
        }
        self._sent = self._unreadable = 0
        self._events: dict[int, list[Event]] = {}
        self._noted: set[tuple[int, str]] = set()
        problems = [problem for one in self._instances.values() if (problem := one.configure()) is not None]
        if problems and len(problems) == len(self._instances):
            raise problems[0]

    def learnt(self) -> bytes:
        """Return what each instance has learnt."""
        found = {v: one.planner.learnt() for v, one in self._instances.items() if one.planner is not None}
        kept = {vehicle: data for vehicle, data in found.items() if data}
        return msgspec.msgpack.encode(kept) if kept else b""

    def inherit(self, learnt: bytes) -> None:
        """Give each instance what the one on the same vehicle has learnt."""
        for vehicle, data in msgspec.msgpack.decode(learnt, type=dict[int, bytes]).items():
            one = self._instances.get(vehicle)
            if one is not None and one.planner is not None:
                one.planner.inherit(data)

    def event(self, event: Event) -> None:
        """Keep an event for the instance of its vehicle."""
        self._events.setdefault(event.vehicle, []).append(event)

    def step(self, ctx: Context) -> Output:
        """Step the instance of every vehicle that is heard, then post messages. Raises RuntimeError if all failed."""
        if self._instances and all(one.error for one in self._instances.values()):
            raise RuntimeError(next(iter(self._instances.values())).error)
        team = _with_position(ctx.fleet)
        arrived = self._network.exchange(team, ctx.t_s)
        out = Output(annotations=None)
        before = [one.annotations for one in self._instances.values()]
        for row, vehicle in enumerate(team.id.tolist()):
            one = self._instances[vehicle]
            view = own_view(team, row, self._network.heard(vehicle), self.task, ctx.t_s)
            out.intents += one.step(self._context(ctx, one, view, arrived), self._events.pop(vehicle, []))
        self._post(ctx.t_s)
        instances = self._instances.values()
        if any(one.annotations is not old for one, old in zip(instances, before, strict=True)):
            out.annotations = [drawing for one in instances for drawing in one.annotations]
        for one in instances:
            out.notes += one.notes
            one.notes = []
        out.notes += self._drops()
        out.metrics = self._metrics()
        return out

    def stop(self, reason: str) -> None:
        """Stop all instances."""
        for one in self._instances.values():
            if one.planner is not None:
                one.planner.stop(reason)

    def snapshot(self) -> bytes:
        """Return the snapshots of all instances, and what is on its way between them."""
        for one in self._instances.values():
            one.keep_snapshot()
        states = {vehicle: one.state() for vehicle, one in self._instances.items()}
        return msgspec.msgpack.encode(TeamState(self._network.state(), states, self._sent, self._unreadable))

    def restore(self, data: bytes) -> None:
        """Take over what `snapshot` gave."""
        state = msgspec.msgpack.decode(data, type=TeamState)
        self._network.restore(state.network)
        self._sent, self._unreadable = state.sent, state.unreadable
        for vehicle, kept in state.instances.items():
            if vehicle in self._instances:
                self._instances[vehicle].restore(kept)

    def _context(
        self, ctx: Context, one: VehicleInstance, view: Fleet, arrived: Mapping[int, list[MessageInFlight]]
    ) -> Context:
        one.radio.refill(ctx.t_s)
        messages = tuple(self._received(arrived.get(one.vehicle, ())))
        return replace(
            ctx,
            fleet=view,
            rng=one.rng,
            deadline_s=ctx.deadline_s / max(len(self._instances), 1),
            tracks=own_tracks(ctx.tracks, one.vehicle),
            task=one.task,
            messages=messages,
            radio=one.radio,
        )

    def _received(self, messages: Iterable[MessageInFlight]) -> Iterable[Received]:
        for message in messages:
            try:
                payload = decoded(message.data, self.kind.message_type)
            except msgspec.MsgspecError:
                self._unreadable += 1
                continue
            yield Received(message.sender, message.sent_s, payload)

    def _post(self, t_s: float) -> None:
        for vehicle, one in self._instances.items():
            sent, one.radio.outbox = one.radio.outbox, []
            self._sent += len(sent)
            for receiver, data in sent:
                self._network.post(t_s, vehicle, receiver, data)

    def _drops(self) -> list[str]:
        """Return a note for the first drop of each reason of each vehicle."""
        notes = []
        for vehicle, one in self._instances.items():
            for why in one.radio.dropped:
                if (vehicle, why) not in self._noted:
                    self._noted.add((vehicle, why))
                    notes.append(f"vehicle {vehicle}: messages are dropped: {why}")
        return notes

    def _metrics(self) -> dict[str, float]:
        """Return each metric as the mean of the instances that give it, and the figures of the network."""
        values: dict[str, list[float]] = {}
        for one in self._instances.values():
            for name, value in one.metrics.items():
                values.setdefault(name, []).append(value)
        counts = self._network.counts
        dropped = sum(sum(one.radio.dropped.values()) for one in self._instances.values())
        figures = (
            self._sent,
            counts["delivered"],
            counts["lost"] + counts["out of range"],
            dropped + counts["queue full"] + self._unreadable,
            sum(bool(one.error) for one in self._instances.values()),
        )
        merged = {name: float(np.mean(found)) for name, found in list(values.items())[: MAX_METRICS - len(figures)]}
        return merged | dict(zip(HOST_METRICS, map(float, figures), strict=True))


def own_view(team: Fleet, row: int, heard: list[Beacon], task: PlannerTask, t_s: float) -> Fleet:
    """Return what the vehicle in this row knows: itself as it is, and neighbours as they were when they sent."""
    me = int(team.id[row])
    rows: list[tuple[Any, ...]] = [
        (
            b.vehicle,
            b.active,
            b.position_m,
            b.velocity_m_s,
            b.heading_deg,
            b.age_s + t_s - b.sent_s,
            b.battery_pct,
            b.held,
        )
        for b in heard
    ]
    own = (team.position_m[row], team.velocity_m_s[row], team.heading_deg[row], team.age_s[row], team.battery_pct[row])
    rows.append((me, bool(team.active[row]), *own, bool(team.held[row])))
    rows.sort(key=lambda one: one[0])
    ids, active, position, velocity, heading, age_s, battery, held = zip(*rows, strict=True)
    view = Fleet(
        id=np.array(ids, dtype=np.int64),
        active=np.array(active, dtype=bool),
        position_m=np.array(position, dtype=float),
        velocity_m_s=np.array(velocity, dtype=float),
        heading_deg=np.array(heading, dtype=float),
        age_s=np.array(age_s, dtype=float),
        layer_m=np.array([task.layers_m.get(vehicle, np.nan) for vehicle in ids], dtype=float),
        battery_pct=np.array(battery, dtype=float),
        held=np.array(held, dtype=bool),
        own=np.array(ids) == me,
        battery_left_s=np.where(np.array(ids) == me, team.battery_left_s[row], np.nan),
        home_s=np.where(np.array(ids) == me, team.home_s[row], np.nan),
        **class_columns(ids, task),
    )
    read_only(vars(view).values())
    return view


def own_tracks(tracks: Tracks, vehicle: int) -> Tracks:
    """Return the targets that the vehicle's own sensors have detected within the last seconds."""
    mine = [vehicle in seen_by for seen_by in tracks.seen_by]
    if all(mine):
        return tracks
    kept = np.array(mine, dtype=bool)
    view = Tracks(
        tracks.id[kept],
        tracks.position_m[kept],
        tracks.velocity_m_s[kept],
        tracks.sigma_m[kept],
        tracks.age_s[kept],
        tracks.confirmed[kept],
        tuple(seen_by for seen_by, is_mine in zip(tracks.seen_by, mine, strict=True) if is_mine),
    )
    read_only(vars(view).values())
    return view


def _with_position(fleet: Fleet) -> Fleet:
    """Return the vehicles that are heard and have a position. The others' instances are not stepped."""
    known = np.isfinite(fleet.position_m).all(axis=1)
    if known.all():
        return fleet
    columns = {name: column[known] for name, column in vars(fleet).items() if isinstance(column, np.ndarray)}
    return Fleet(**columns)
