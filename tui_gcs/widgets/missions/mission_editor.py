"""What is being planned: whose plan, which of its three kinds, which item; every edit undoable. Plain, no Textual.

Places go in and out as ENU metres; heights as the item's own.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.zones import Polygon, Shape
from tui_gcs.core.missions import fences
from tui_gcs.core.missions import item_edits as edits
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.command_reference import with_command
from tui_gcs.core.missions.crew import planned_vehicles
from tui_gcs.core.missions.draft import Items, MissionDraft, MissionHistory, MissionStep, Where
from tui_gcs.core.missions.forecast import Forecast
from tui_gcs.core.missions.generate import OWN_ITEMS, GenerationRequest, generated
from tui_gcs.core.missions.layered_copies import copied
from tui_gcs.core.missions.patrol_crossings import Flown, flown_by, patrols
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.plans.check import MAX_ITEMS
from tui_gcs.core.plans.model import HERE, LAND, RETURN, VTOL_LAND, PlanItem, PlanKind
from tui_gcs.core.protocol.common import Annotation, VehicleRow
from tui_gcs.core.scenario.model import Round, Scenario

Place = tuple[float, float]
NEW_STEP_M = 20.0
"""A new item lies so far beyond the one before."""
NEW_RADIUS_M = 50.0
ENDS = frozenset({RETURN, LAND, VTOL_LAND})
"""What is added at the end of a mission comes before these."""
AREA_NAME = "operating area"
KINDS = tuple(PlanKind)
SQUARE = ((-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0))
"""Clockwise, as QGroundControl draws."""


class MissionEditor:
    """One draft, and where in it the operator is."""

    def __init__(self) -> None:
        """Of nothing yet."""
        self.history = MissionHistory(MissionDraft())
        self.forecast = Forecast()
        self.scenario: Scenario | None = None
        self.vehicle = 0
        self.kind = PlanKind.MISSION
        self.index = 0
        self.preview: MissionDraft | None = None
        """What would be generated; shown instead of the draft until it is taken or dropped."""
        self._beside: tuple[Flown, Mapping[str, Sequence[Annotation]]] = ({}, {})
        """Who flies for planners, and what these have drawn."""
        self._before_choosing: PlanItem | None = None
        """The edited item as it was before another command was chosen for it."""
        self.has_assumed = False
        """What vehicles can was said by the operator or a file; else the speed is the scenario's."""

    # ------------------------------------------------------------ what there is

    @property
    def draft(self) -> MissionDraft:
        """What is shown."""
        return self.preview if self.preview is not None else self.history.draft

    @property
    def items(self) -> Items:
        """The edited ones."""
        return self.draft.of(self.vehicle).items(self.kind)

    @property
    def item(self) -> PlanItem | None:
        """The edited one."""
        return self.items[self.index] if 0 <= self.index < len(self.items) else None

    @property
    def frame(self) -> LocalFrame:
        """The scenario's."""
        return self.forecast.frame

    @property
    def vehicles(self) -> tuple[int, ...]:
        """All that can be planned for."""
        return tuple(sorted({*self.forecast.crew, *self.draft.vehicles}))

    def place_m(self, item: PlanItem) -> Place | None:
        """Where an item is; None: nowhere."""
        if not item.is_place or (item.x == 0 and item.y == 0):
            return None
        return self.frame.to_enu(item.lat_deg, item.lon_deg)

    def set_site(
        self,
        scenario: Scenario,
        current: Round,
        rows: Sequence[VehicleRow],
        drawn: Mapping[str, Sequence[Annotation]],
    ) -> bool:
        """Plan here, for these, beside what planners have `drawn`; whether anything changed."""
        look = self.forecast
        before = (look.current, look.crew, look.limits)
        beside_before, self._beside = self._beside, (flown_by(rows), drawn)
        if self.scenario is None or self.scenario.origin != scenario.origin:
            look.frame = LocalFrame(scenario.origin)
        if self.scenario is None or self.scenario.limits != scenario.limits:
            limits = scenario.limits
            if not self.has_assumed:
                look.performance = replace(look.performance, speed_m_s=limits.speed_m_s)
            look.performance = replace(look.performance, accel_m_s2=limits.accel_m_s2)
            look.limits = limits
        self.scenario, look.current = scenario, current
        look.crew = planned_vehicles(scenario, rows, look.crew)
        if self.vehicle not in self.vehicles and self.vehicles:
            self.choose_vehicle(self.vehicles[0])
        if self._beside != beside_before:
            look.patrols = patrols(*self._beside)
        return self._beside != beside_before or before != (look.current, look.crew, look.limits)

    def assume(self, performance: Performance | None) -> None:
        """Foretell with this; None: as before."""
        if performance is not None:
            accel = self.forecast.performance.accel_m_s2
            self.forecast.performance = replace(performance, accel_m_s2=accel)
            self.has_assumed = True

    # ------------------------------------------------------------ where the operator is

    def choose_vehicle(self, vehicle: int) -> bool:
        """Edit this one's plan; False if there is none such."""
        if vehicle not in self.vehicles:
            return False
        self.vehicle, self.index = vehicle, 0
        self.history.end_subject()
        return True

    def step_vehicle(self, by: int) -> None:
        """The next one, round and round."""
        ids = self.vehicles
        if ids:
            at = ids.index(self.vehicle) if self.vehicle in ids else 0
            self.choose_vehicle(ids[(at + by) % len(ids)])

    def step_kind(self) -> None:
        """Mission, fence, rally points."""
        self.choose_kind(KINDS[(self.kind + 1) % len(KINDS)])

    def choose_kind(self, kind: PlanKind) -> None:
        """This one."""
        if kind is not self.kind:
            self.kind, self.index = kind, 0
            self.history.end_subject()

    def choose(self, index: int) -> None:
        """This item, or the nearest there is."""
        new = min(max(index, 0), max(len(self.items) - 1, 0))
        if new != self.index:
            self.history.end_subject()
        self.index = new

    def nearest(self, place_m: Place, within_m: float) -> int | None:
        """The edited item nearest to a place on the map."""
        best, found = within_m, None
        for i, item in enumerate(self.items):
            there = self.place_m(item)
            if there is not None and math.dist(there, place_m) <= best:
                best, found = math.dist(there, place_m), i
        return found

    # ------------------------------------------------------------ edits

    def add(self, place_m: Place | None = None) -> str:
        """One more after the edited one, there or a little further on; what was done, in words."""
        if len(self.items) >= MAX_ITEMS:
            return f"not added: {MAX_ITEMS} items are the most"
        here = place_m or self._further_on(self.index + 1)
        at = self.index + 1 if self.items else 0
        if self.item is not None and self.item.command in ENDS:
            at -= 1
        match self.kind:
            case PlanKind.MISSION:
                new = self._new_mission_items(here)
                items = edits.insert(self.items, at, new)
                at += len(new) - 1
            case PlanKind.FENCE:
                items, at = self._fenced(here)
            case PlanKind.RALLY:
                point = fences.rally_point(self.frame.to_geodetic(*here), self._height_m(self.index + 1))
                items = edits.insert(self.items, at, [point])
        self._edit(f"{self.kind.word} {at + 1} added", items)
        self.choose(at)
        return f"{self.kind.word} {self.index + 1} added"

    def add_fence(self, place_m: Place | None = None) -> str:
        """One more polygon, whose corners are then moved: the only way to it where no zone is of its form."""
        if len(self.items) + len(SQUARE) > MAX_ITEMS:
            return f"not added: {MAX_ITEMS} items are the most"
        east, north = place_m or self.forecast.member(self.vehicle).home.place_m
        corners = [self.frame.to_geodetic(east + x * NEW_RADIUS_M, north + y * NEW_RADIUS_M) for x, y in SQUARE]
        at = len(self.items)
        self._edit("fence polygon added", (*self.items, *fences.polygon(corners)))
        self.choose(at)
        return "polygon added: e and + move and add corners, i turns it inside out"

    def add_circle(self, place_m: Place | None = None) -> str:
        """One more circle, also where a polygon is edited."""
        if len(self.items) >= MAX_ITEMS:
            return f"not added: {MAX_ITEMS} items are the most"
        here = place_m or self.forecast.member(self.vehicle).home.place_m
        at = len(self.items)
        self._edit("fence circle added", (*self.items, *fences.circle(self.frame.to_geodetic(*here), NEW_RADIUS_M)))
        self.choose(at)
        return "circle added: e moves it, Tab its radius, i turns it inside out"

    def delete(self) -> str:
        """Without the edited one."""
        if self.item is None:
            return "nothing to delete"
        led = edits.jumps_to(self.items, self.index) if self.kind is PlanKind.MISSION else 0
        fence = self.kind is PlanKind.FENCE
        items = fences.delete_item(self.items, self.index) if fence else edits.delete(self.items, self.index)
        label = f"{self.kind.word} {self.index + 1} deleted"
        self._edit(label, items)
        self.choose(self.index)
        more = f"; {led} jump{'s' * (led > 1)} to it: now to the next" if led else ""
        return f"{label}, u brings it back{more}"

    def reorder(self, by: int) -> str:
        """Earlier or later."""
        if self.item is None or self.kind is PlanKind.FENCE:
            return "corners are moved on the map" if self.item is not None else ""
        items, to = edits.reorder(self.items, self.index, by)
        self._edit(f"{self.kind.word} {self.index + 1} moved to {to + 1}", items, f"reorder {self.kind}")
        self.index = to
        return f"now number {to + 1}"

    def replace_item(self, item: PlanItem, field: str) -> None:
        """Put this in the place of the edited one."""
        if self.item is not None:
            label = f"{self.kind.word} {self.index + 1} {field}".rstrip()
            self._edit(label, edits.put(self.items, self.index, item), self._subject(field))

    def as_command(self, word: str) -> PlanItem:
        """The edited item as another command, keeping what it has.

        Commands are gone through one by one, and some have no place: place, height and parameters are those from
        before the first change, not lost on the way. One that never was anywhere comes where a new one would.
        """
        item = self.item
        if item is None:
            raise LookupError("no item is edited")
        if self._before_choosing is None or self.history.subject != self._subject("command"):
            self._before_choosing = item
        before = self._before_choosing
        new = with_command(before, word)
        if new is before or not new.is_place or before.is_place:
            return new
        lands = new.command in (LAND, VTOL_LAND)
        x, y = (0, 0) if new.command in HERE else self._to_deg7(self._further_on(self.index))
        return replace(new, x=x, y=y, z=0.0 if lands else self._height_m(self.index))

    def retract(self) -> None:
        """The open field holds a value that is not allowed: what was half typed is not meant."""
        self.history.retract()
        self._look()

    def place(self, place_m: Place) -> None:
        """Have the edited one there."""
        item = self.item
        if item is not None and item.is_place:
            x, y = self._to_deg7(place_m)
            self.replace_item(replace(item, x=x, y=y), "place")

    def shift(self, east_m: float, north_m: float, *, whole: bool) -> str:
        """Move the edited one, or the whole plan of this kind."""
        chosen = range(len(self.items)) if whole else range(self.index, self.index + 1)
        north, east = north_m / self.frame.north_m_per_deg, east_m / self.frame.east_m_per_deg
        items = edits.shifted(self.items, chosen, round(north * 1e7), round(east * 1e7))
        label = f"{self.kind.word} moved" if whole else f"{self.kind.word} {self.index + 1} place"
        self._edit(label, items, f"{self.vehicle} {label}")
        return "" if items != self.items or self.item is None or self.item.is_place else "this item has no place"

    def other_side(self) -> str:
        """Inclusion or exclusion."""
        if self.kind is not PlanKind.FENCE or self.item is None:
            return "only fences have an inside"
        self._edit("inside and outside", fences.other_side(self.items, self.index))
        return "inside and outside changed"

    def clear(self) -> str:
        """Plan nothing of this kind for this vehicle."""
        if not self.items:
            return f"no {self.kind.word} to clear"
        self._edit(f"{self.kind.word} of {self.vehicle} cleared", ())
        self.choose(0)
        return f"{self.kind.word} of vehicle {self.vehicle} cleared here, u brings it back"

    def take(self, label: str, draft: MissionDraft) -> None:
        """Another draft as one edit: generated, downloaded, read from a file."""
        self.preview = None
        self.history.do(label, draft, where=self._where)
        self.history.end_subject()
        self._look()
        self.choose(self.index)

    def copy_to(self, vehicles: Sequence[int], kinds: Sequence[PlanKind]) -> None:
        """Plan the same of these kinds for others. Raises GeneratorError."""
        look = self.forecast
        draft = copied(self.history.draft, self.vehicle, vehicles, kinds, look.crew, look.frame)
        self.take(f"plans of {self.vehicle} copied", draft)

    def undo(self) -> str:
        """Take the last edit back, and go where it was."""
        return self._went("undone", self.history.undo()) or "nothing to undo"

    def redo(self) -> str:
        """Do it again."""
        return self._went("done again", self.history.redo()) or "nothing to do again"

    def _went(self, what: str, step: MissionStep | None) -> str:
        self.preview = None
        self._look()
        if step is None:
            return ""
        if step.where is not None:
            self.vehicle, self.kind, self.index = step.where
        self.choose(self.index)
        return f"{what}: {step.label}"

    # ------------------------------------------------------------ generating

    def shapes(self) -> dict[str, Shape]:
        """What can be generated over, by name."""
        found: dict[str, Shape] = {}
        places = [place for item in self.history.draft.of(self.vehicle).mission if (place := self.place_m(item))]
        if self.forecast.current is not None:
            found |= {zone.name: zone.shape for zone in self.forecast.current.zones}
            found[AREA_NAME] = self.forecast.current.area.shape
        if len(places) >= 2:
            found[OWN_ITEMS] = Polygon(tuple(places))
        return found

    def foresee(self, wanted: GenerationRequest) -> None:
        """Show what would be generated. Raises GeneratorError; then the draft is shown."""
        self.preview = None
        look = self.forecast
        shape = self.shapes().get(wanted.over, Polygon(()))
        try:
            self.preview = generated(self.history.draft, wanted, shape, look.crew, look.frame, look.performance)
        finally:
            self._look()

    def drop_preview(self) -> None:
        """Show the draft again."""
        self.preview = None
        self._look()

    # ------------------------------------------------------------ inside

    @property
    def _where(self) -> Where:
        return self.vehicle, self.kind, self.index

    def _subject(self, field: str) -> str:
        return f"{self.vehicle} {self.kind.word} {self.index + 1} {field}".rstrip()

    def _to_deg7(self, place_m: Place) -> tuple[int, int]:
        lat_deg, lon_deg = self.frame.to_geodetic(*place_m)
        return round(lat_deg * 1e7), round(lon_deg * 1e7)

    def _edit(self, label: str, items: Items, subject: str = "") -> None:
        self.preview = None
        self.history.do(label, self.history.draft.with_items(self.vehicle, self.kind, items), subject, self._where)
        self._look()

    def _look(self) -> None:
        self.forecast.draft = self.draft

    def _new_mission_items(self, here: Place) -> Items:
        """The first one brings its take-off."""
        new = build.waypoint(self.frame, here, self._height_m(self.index + 1))
        home_m = self.forecast.member(self.vehicle).home.place_m
        return (new,) if self.items else (build.take_off(self.frame, home_m, self._height_m(self.index + 1)), new)

    def _height_m(self, at: int) -> float:
        """As high as the items before that; the first one on the vehicle's own layer."""
        before = [item.z for item in self.items[:at] if item.is_place]
        return before[-1] if before else self.forecast.member(self.vehicle).layer_m

    def _fenced(self, here: Place) -> tuple[Items, int]:
        """One more corner of the edited polygon, or a circle where none is edited."""
        place_deg = self.frame.to_geodetic(*here)
        more = fences.add_corner(self.items, self.index, place_deg) if self.items else ()
        if len(more) > len(self.items):
            return more, self.index + 1
        return (*self.items, *fences.circle(place_deg, NEW_RADIUS_M)), len(self.items)

    def _further_on(self, at: int) -> Place:
        """Beyond the items before that, in the direction in which they lead; the first one, north of the start."""
        home = self.forecast.member(self.vehicle).home.place_m
        places = [place for item in self.items[:at] if (place := self.place_m(item)) is not None]
        here, before = (places[-1] if places else home), (places[-2] if len(places) > 1 else home)
        far = math.dist(here, before)
        if far < 1.0:
            return here[0], here[1] + NEW_STEP_M
        step = NEW_STEP_M / far
        return here[0] + (here[0] - before[0]) * step, here[1] + (here[1] - before[1]) * step
