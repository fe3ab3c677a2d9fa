"""Edits of the items of the edited plan: way-points, fence corners, rally points. Independent of Textual."""

import math
from dataclasses import replace

from tui_gcs.core.missions import fences
from tui_gcs.core.missions import item_edits as edits
from tui_gcs.core.missions import mission_builder as build
from tui_gcs.core.missions.command_reference import with_command
from tui_gcs.core.missions.draft import Items
from tui_gcs.core.plans.check import MAX_ITEMS
from tui_gcs.core.plans.model import HERE, LAND, RETURN, VTOL_LAND, PlanItem, PlanKind
from tui_gcs.widgets.missions.mission_editor import MissionEditor, Place

NEW_STEP_M = 20.0
"""Distance of a new item from the item before it."""
NEW_RADIUS_M = 50.0
"""Radius of a new fence circle, and half the side of a new fence polygon."""
ENDS = frozenset({RETURN, LAND, VTOL_LAND})
"""Commands that end a mission: an item that is added after one of these is inserted before it."""
SQUARE = ((-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0))
"""Corners (east, north) of a new fence polygon, clockwise as QGroundControl draws."""


class MissionEdits:
    """Changes the items of the edited vehicle and kind. A string that is returned is a line for the operator."""

    def __init__(self, editor: MissionEditor) -> None:
        self.editor = editor
        self._before_choosing: PlanItem | None = None
        """The edited item as it was before the operator began to go through its commands."""

    def add(self, place_m: Place | None = None) -> str:
        """Insert an item after the edited one: at `place_m`, or a little beyond the items before."""
        editor = self.editor
        if len(editor.items) >= MAX_ITEMS:
            return f"not added: a mission holds at most {MAX_ITEMS} items"
        here = place_m or self._next_place(editor.index + 1)
        at = editor.index + 1 if editor.items else 0
        # What is added at the end of a mission comes before its return or landing, or it would never be flown.
        if editor.item is not None and editor.item.command in ENDS:
            at -= 1
        match editor.kind:
            case PlanKind.MISSION:
                new = self._new_mission_items(here)
                items = edits.insert(editor.items, at, new)
                at += len(new) - 1
            case PlanKind.FENCE:
                items, at = self._with_fence_corner(here)
            case PlanKind.RALLY:
                point = fences.rally_point(editor.frame.to_geodetic(*here), self._height_m(editor.index + 1))
                items = edits.insert(editor.items, at, [point])
        editor.edit(f"{editor.kind.word} {at + 1} added", items)
        editor.choose(at)
        return f"{editor.kind.word} {editor.index + 1} added"

    def add_fence(self, place_m: Place | None = None) -> str:
        """Add a square fence polygon around `place_m` or the vehicle's home."""
        editor = self.editor
        if len(editor.items) + len(SQUARE) > MAX_ITEMS:
            return f"not added: a mission holds at most {MAX_ITEMS} items"
        east, north = place_m or editor.forecast.vehicle(editor.vehicle).home.place_m
        corners = [editor.frame.to_geodetic(east + x * NEW_RADIUS_M, north + y * NEW_RADIUS_M) for x, y in SQUARE]
        at = len(editor.items)
        editor.edit("fence polygon added", (*editor.items, *fences.polygon(corners)))
        editor.choose(at)
        return "polygon added: e and + move and add corners, i turns it inside out"

    def add_circle(self, place_m: Place | None = None) -> str:
        """Add a fence circle around `place_m` or the vehicle's home."""
        editor = self.editor
        if len(editor.items) >= MAX_ITEMS:
            return f"not added: a mission holds at most {MAX_ITEMS} items"
        here = place_m or editor.forecast.vehicle(editor.vehicle).home.place_m
        at = len(editor.items)
        circle = fences.circle(editor.frame.to_geodetic(*here), NEW_RADIUS_M)
        editor.edit("fence circle added", (*editor.items, *circle))
        editor.choose(at)
        return "circle added: e moves it, Tab its radius, i turns it inside out"

    def delete(self) -> str:
        """Delete the edited item; jumps to it lead to the next one."""
        editor = self.editor
        if editor.item is None:
            return "nothing to delete"
        jumps = edits.jumps_to(editor.items, editor.index) if editor.kind is PlanKind.MISSION else 0
        is_fence = editor.kind is PlanKind.FENCE
        delete = fences.delete_item if is_fence else edits.delete
        items = delete(editor.items, editor.index)
        label = f"{editor.kind.word} {editor.index + 1} deleted"
        editor.edit(label, items)
        editor.choose(editor.index)
        more = f"; {jumps} jump{'s' * (jumps > 1)} to it: now to the next" if jumps else ""
        return f"{label}, u brings it back{more}"

    def reorder(self, by: int) -> str:
        """Move the edited item `by` places later in the list, earlier if negative."""
        editor = self.editor
        if editor.item is None or editor.kind is PlanKind.FENCE:
            return "corners are moved on the map" if editor.item is not None else ""
        items, to = edits.reorder(editor.items, editor.index, by)
        label = f"{editor.kind.word} {editor.index + 1} moved to {to + 1}"
        editor.edit(label, items, f"reorder {editor.kind}")
        editor.index = to
        return f"now number {to + 1}"

    def replace_item(self, item: PlanItem, field: str) -> None:
        """Replace the edited item; `field` is the form field that is being typed into."""
        editor = self.editor
        if editor.item is not None:
            label = f"{editor.kind.word} {editor.index + 1} {field}".rstrip()
            editor.edit(label, edits.put(editor.items, editor.index, item), self._subject(field))

    def as_command(self, word: str) -> PlanItem:
        """Return the edited item with another command. Raises LookupError if no item is edited.

        Place, height and parameters are those from before the operator began to go through the commands, some of which
        have no place: nothing is lost on the way. An item that never had a place gets that of a new item.
        """
        editor = self.editor
        item = editor.item
        if item is None:
            raise LookupError("no item is edited")
        # Commands are gone through one by one with the arrows.
        if self._before_choosing is None or editor.history.subject != self._subject("command"):
            self._before_choosing = item
        before = self._before_choosing
        new = with_command(before, word)
        if new is before or not new.is_place or before.is_place:
            return new
        lands = new.command in (LAND, VTOL_LAND)
        x, y = (0, 0) if new.command in HERE else self._to_deg7(self._next_place(editor.index))
        return replace(new, x=x, y=y, z=0.0 if lands else self._height_m(editor.index))

    def place(self, place_m: Place) -> None:
        """Move the edited item to `place_m`, if its command has a place."""
        item = self.editor.item
        if item is not None and item.is_place:
            x, y = self._to_deg7(place_m)
            self.replace_item(replace(item, x=x, y=y), "place")

    def shift(self, east_m: float, north_m: float, *, whole: bool) -> str:
        """Move the edited item, or with `whole` all items of this kind."""
        editor = self.editor
        chosen = range(len(editor.items)) if whole else range(editor.index, editor.index + 1)
        north, east = north_m / editor.frame.north_m_per_deg, east_m / editor.frame.east_m_per_deg
        items = edits.shifted(editor.items, chosen, round(north * 1e7), round(east * 1e7))
        label = f"{editor.kind.word} moved" if whole else f"{editor.kind.word} {editor.index + 1} place"
        editor.edit(label, items, f"{editor.vehicle} {label}")
        is_moved = items != editor.items or editor.item is None or editor.item.is_place
        return "" if is_moved else "this item has no place"

    def other_side(self) -> str:
        """Turn the edited fence from inclusion to exclusion, or back."""
        editor = self.editor
        if editor.kind is not PlanKind.FENCE or editor.item is None:
            return "only fences have an inside"
        editor.edit("inside and outside", fences.other_side(editor.items, editor.index))
        return "inside and outside changed"

    def clear(self) -> str:
        """Delete all items of this kind for this vehicle."""
        editor = self.editor
        if not editor.items:
            return f"no {editor.kind.word} to clear"
        editor.edit(f"{editor.kind.word} of {editor.vehicle} cleared", ())
        editor.choose(0)
        return f"{editor.kind.word} of vehicle {editor.vehicle} cleared here, u brings it back"

    def _subject(self, field: str) -> str:
        editor = self.editor
        return f"{editor.vehicle} {editor.kind.word} {editor.index + 1} {field}".rstrip()

    def _to_deg7(self, place_m: Place) -> tuple[int, int]:
        lat_deg, lon_deg = self.editor.frame.to_geodetic(*place_m)
        return round(lat_deg * 1e7), round(lon_deg * 1e7)

    def _new_mission_items(self, here: Place) -> Items:
        # The first way-point of a mission brings its take-off.
        editor, height_m = self.editor, self._height_m(self.editor.index + 1)
        new = build.waypoint(editor.frame, here, height_m)
        home_m = editor.forecast.vehicle(editor.vehicle).home.place_m
        return (new,) if editor.items else (build.take_off(editor.frame, home_m, height_m), new)

    def _height_m(self, at: int) -> float:
        """Return the height of the last placed item before index `at`, or the vehicle's own layer."""
        before = [item.z for item in self.editor.items[:at] if item.is_place]
        return before[-1] if before else self.editor.forecast.vehicle(self.editor.vehicle).layer_m

    def _with_fence_corner(self, here: Place) -> tuple[Items, int]:
        """Add a corner to the edited polygon, or a circle where no polygon is edited; also return its index."""
        editor = self.editor
        place_deg = editor.frame.to_geodetic(*here)
        more = fences.add_corner(editor.items, editor.index, place_deg) if editor.items else ()
        if len(more) > len(editor.items):
            return more, editor.index + 1
        return (*editor.items, *fences.circle(place_deg, NEW_RADIUS_M)), len(editor.items)

    def _next_place(self, at: int) -> Place:
        """Return a place beyond the items before index `at`, in their direction; north of home for the first item."""
        editor = self.editor
        home = editor.forecast.vehicle(editor.vehicle).home.place_m
        places = [place for item in editor.items[:at] if (place := editor.place_m(item)) is not None]
        here, before = (places[-1] if places else home), (places[-2] if len(places) > 1 else home)
        far = math.dist(here, before)
        if far < 1.0:
            return here[0], here[1] + NEW_STEP_M
        step = NEW_STEP_M / far
        return here[0] + (here[0] - before[0]) * step, here[1] + (here[1] - before[1]) * step
