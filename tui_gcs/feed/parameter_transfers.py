"""Parameters on their way between the station and this console: looked up, fetched from vehicles, set, taken back."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.services import (
    MAX_VALUES,
    FetchParams,
    GetParamInfos,
    GetParams,
    ParamInfoRow,
    SetParams,
    TaskInfo,
)
from tui_gcs.core.protocol.setup import Number
from tui_gcs.feed.fleet_parameters import FleetParameters
from tui_gcs.feed.requests import ConsoleRequests
from tui_gcs.feed.task_requests import TaskOutcome, carry_out

Values = Mapping[str, Number]
MAX_UNDO = 50
"""How many changes can be taken back."""


@dataclass(frozen=True)
class ParameterChange:
    """Values to set, by vehicle."""

    what: str
    """The change in words: `WPNAV_SPEED = 700`."""
    values: Mapping[int, Values]

    @property
    def vehicles(self) -> tuple[int, ...]:
        """The vehicles that are changed."""
        return tuple(self.values)


@dataclass(frozen=True)
class ChangeOutcome:
    """What became of a change for one vehicle."""

    vehicle: int
    done: int
    """How many of its values were set."""
    total: int
    error: str = ""
    out_of_range: tuple[str, ...] = ()
    """What was not set because the vehicle's own description excludes the value."""
    remark: str = ""
    """What is to be known of values that were set: that their ranges are not known."""


class ParameterTransfers:
    """Brings parameters of vehicles into `parameters`, and sets them; remembers the former values for undo."""

    def __init__(self, requests: ConsoleRequests, clock: Clock, on_news: Callable[[], None]) -> None:
        """Ask by `requests`; `on_news` is called whenever there is something new to show."""
        self.parameters = FleetParameters()
        self.progress: dict[int, TaskInfo] = {}
        """Fetches and settings that are under way, by vehicle."""
        self.description: ParamInfoRow | None = None
        """What a vehicle says about the parameter that was described last."""
        self._requests = requests
        self._clock = clock
        self._on_news = on_news
        self._undo: list[ParameterChange] = []

    async def look(self, vehicles: Sequence[int]) -> None:
        """Ask the station what it knows of these vehicles' parameters; nothing is sent to a vehicle."""
        for vehicle in vehicles:
            reply = await self._requests.send(GetParams(vehicle))
            if reply.ok:
                self.parameters.take(vehicle, reply.params, complete=reply.complete)
        self._on_news()

    async def describe(self, vehicle: int, name: str) -> None:
        """Ask the station for a vehicle's own description of a parameter; `description` then holds it, or None."""
        reply = await self._requests.send(GetParamInfos(vehicle, (name,)))
        new = reply.param_infos[0] if reply.param_infos else None
        if new != self.description:
            self.description = new
            self._on_news()

    async def fetch(self, vehicles: Sequence[int]) -> tuple[TaskOutcome, ...]:
        """Fetch all parameters from these vehicles; return one outcome for each."""
        ended = await self._carry_out(FetchParams(tuple(vehicles), meanings=True))
        await self.look([one.vehicle for one in ended])
        return ended

    async def change(
        self, change: ParameterChange, *, in_flight: bool = False, beyond_range: bool = False
    ) -> tuple[ChangeOutcome, ...]:
        """Set the values of a change, and remember what was there before for `undo`.

        Vehicles that get the same values are asked in one request. `in_flight`: it is meant for vehicles in the air.
        `beyond_range`: the values are meant though the vehicle's own description excludes them.
        """
        before = {
            vehicle: {name: held[name].value for name in values if name in held}
            for vehicle, values in change.values.items()
            if (held := self.parameters.of(vehicle)) is not None
        }
        outcomes: list[ChangeOutcome] = []
        for values, vehicles in _by_values(change):
            outcomes += await self._set(vehicles, values, in_flight=in_flight, beyond_range=beyond_range)
        await self.look(change.vehicles)
        # Only what was really changed is taken back: a refused value is still the former one.
        restore = {vehicle: self._changed(vehicle, former) for vehicle, former in before.items()}
        restore = {vehicle: former for vehicle, former in restore.items() if former}
        if restore:
            self._undo = [*self._undo, ParameterChange(f"undo of {change.what}", restore)][-MAX_UNDO:]
        return tuple(sorted(outcomes, key=lambda one: one.vehicle))

    @property
    def undo(self) -> ParameterChange | None:
        """The change that takes the newest one back; None if there is none."""
        return self._undo[-1] if self._undo else None

    async def take_back(self, *, in_flight: bool = False) -> tuple[ChangeOutcome, ...]:
        """Carry out `undo`; it stays if a vehicle refused it. The former values may be beyond their ranges."""
        change = self._undo.pop()
        kept = list(self._undo)
        outcomes = await self.change(change, in_flight=in_flight, beyond_range=True)
        failed = [one for one in outcomes if one.error]
        # Undoing an undo is not offered: the newest change before it is next.
        self._undo = [*kept, change] if failed else kept
        return outcomes

    def _changed(self, vehicle: int, former: Values) -> Values:
        held = self.parameters.of(vehicle)
        return {name: value for name, value in former.items() if name in held and held[name].value != value}

    async def _set(
        self, vehicles: tuple[int, ...], values: Values, *, in_flight: bool, beyond_range: bool
    ) -> list[ChangeOutcome]:
        done = dict.fromkeys(vehicles, 0)
        errors: dict[int, list[str]] = {vehicle: [] for vehicle in vehicles}
        beyond: dict[int, tuple[str, ...]] = dict.fromkeys(vehicles, ())
        remarks = dict.fromkeys(vehicles, "")
        left = iter(values.items())
        while portion := dict(islice(left, MAX_VALUES)):
            open_ = tuple(vehicle for vehicle in vehicles if not errors[vehicle] or done[vehicle])
            if not open_:
                break
            request = SetParams(open_, portion, in_flight=in_flight, beyond_range=beyond_range)
            for one in await self._carry_out(request):
                done[one.vehicle] += len(portion) if one.ok else len(one.result.params) if one.result else 0
                beyond[one.vehicle] += one.result.out_of_range if one.result else ()
                if one.ok:
                    remarks[one.vehicle] = one.text
                else:
                    errors[one.vehicle].append(one.text)
        return [ChangeOutcome(v, done[v], len(values), "; ".join(errors[v]), beyond[v], remarks[v]) for v in vehicles]

    async def _carry_out(self, request: FetchParams | SetParams) -> tuple[TaskOutcome, ...]:
        def show(tasks: tuple[TaskInfo, ...]) -> None:
            for vehicle in request.vehicles:
                self.progress.pop(vehicle, None)
            self.progress |= {task.vehicle: task for task in tasks}
            self._on_news()

        try:
            return await carry_out(self._requests, self._clock, request, show)
        finally:
            show(())


def _by_values(change: ParameterChange) -> list[tuple[Values, tuple[int, ...]]]:
    """Return each distinct set of values once, with its vehicles."""
    groups: dict[tuple[tuple[str, Number], ...], list[int]] = {}
    for vehicle, values in change.values.items():
        groups.setdefault(tuple(values.items()), []).append(vehicle)
    return [(dict(values), tuple(vehicles)) for values, vehicles in groups.items()]
