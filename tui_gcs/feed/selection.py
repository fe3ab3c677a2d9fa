"""Which vehicles this console's commands are for: chosen by name, always shown, never implied by a view.

`Selection` is the state; `parse_selection` reads what an operator types: `3-7,9`, `t1`, the name of a team or a saved
group, `all`, `none`, `invert`; `+5` adds, `-5` takes away, `name=3-7` saves a group, `name=none` forgets it.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

MAX_NAME = 16
"""Letters of a group's name."""
_NAME = re.compile(r"[a-z_][a-z0-9_]*")
_TEAM = re.compile(r"t([1-9][0-9]?)")
_RANGE = re.compile(r"([0-9]{1,6})(?:-([0-9]{1,6}))?")
WORDS = frozenset({"all", "none", "invert"})


class SelectionError(ValueError):
    """What was typed names no vehicles; the text is one line for the operator."""


@dataclass(frozen=True)
class KnownVehicles:
    """What typed names can mean now."""

    ids: tuple[int, ...]
    """Every vehicle of the fleet."""
    teams: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    """Members by team, in the order of the scenario: `t1` is the first."""
    groups: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    """Vehicles of each group that the operator saved."""
    selected: tuple[int, ...] = ()


@dataclass(frozen=True)
class SelectionChoice:
    """The vehicles that were typed; `save_as` names a group that is to be saved or forgotten."""

    ids: tuple[int, ...]
    save_as: str = ""


def parse_selection(text: str, known: KnownVehicles) -> SelectionChoice:
    """Return the vehicles that `text` names.

    Raises:
        SelectionError: no such vehicle, team or group, or a name that cannot be one.
    """
    text = text.strip().casefold()
    save_as = ""
    if "=" in text:
        save_as, text = (part.strip() for part in text.split("=", 1))
        if not _NAME.fullmatch(save_as) or save_as in WORDS or _TEAM.fullmatch(save_as) or save_as in known.teams:
            raise SelectionError(f"a group cannot be called {save_as[:MAX_NAME]!r}: letters and digits, no team's name")
        save_as = save_as[:MAX_NAME]
    sign = text[:1] if text[:1] in ("+", "-") else ""
    terms = [term for term in re.split(r"[,\s]+", text[len(sign) :]) if term]
    if not terms and not (save_as and not text):
        raise SelectionError("name vehicles: 3-7,9  t1  a team  all  none  invert")
    named: dict[int, None] = dict.fromkeys(known.selected if save_as and not terms else ())
    for term in terms:
        named.update(dict.fromkeys(_term(term, known)))
    selected = set(known.selected)
    result = selected | set(named) if sign == "+" else selected - set(named) if sign == "-" else set(named)
    return SelectionChoice(tuple(sorted(result)), save_as)


def _term(term: str, known: KnownVehicles) -> Iterable[int]:
    if term == "all":
        return known.ids
    if term == "none":
        return ()
    if term == "invert":
        return [v for v in known.ids if v not in known.selected]
    if (match := _RANGE.fullmatch(term)) is not None:
        return _range(int(match[1]), int(match[2] or match[1]), known)
    by_name = {name.casefold(): ids for name, ids in (*known.groups.items(), *known.teams.items())}
    if term in by_name:
        return by_name[term]
    if (match := _TEAM.fullmatch(term)) is not None and int(match[1]) <= len(known.teams):
        return list(known.teams.values())[int(match[1]) - 1]
    names = ", ".join((*known.teams, *known.groups)) or "none"
    raise SelectionError(f"no team or group {term[:MAX_NAME]!r}; there are: {names}")


def _range(low: int, high: int, known: KnownVehicles) -> list[int]:
    """Return the vehicles of a range that exist; a single id must exist."""
    if low > high:
        raise SelectionError(f"{low}-{high} is no range of vehicles")
    found = [v for v in known.ids if low <= v <= high]
    if not found:
        raise SelectionError(f"no vehicle {low}" if low == high else f"no vehicle from {low} to {high}")
    return found


class Selection:
    """The vehicles that are selected, and the one of them that is looked at (its values, the map's follow)."""

    def __init__(self, on_change: Callable[[], None] = lambda: None) -> None:
        """Begin without vehicles; `on_change` is called after every change."""
        self.ids: tuple[int, ...] = ()
        self.lead: int | None = None
        """The vehicle that is looked at: one of `ids`, None without any."""
        self.groups: dict[str, tuple[int, ...]] = {}
        self._on_change = on_change

    def __contains__(self, vehicle: int) -> bool:
        """Whether this vehicle is selected."""
        return vehicle in self.ids

    def set(self, ids: Iterable[int], lead: int | None = None) -> None:
        """Select exactly these; `lead` is looked at, else the one that was, else the first."""
        new = tuple(sorted(set(ids)))
        first = new[0] if new else None
        looked_at = next((v for v in (lead, self.lead) if v in new), first)
        if (new, looked_at) != (self.ids, self.lead):
            self.ids, self.lead = new, looked_at
            self._on_change()

    def choose(self, text: str, known: KnownVehicles) -> SelectionChoice:
        """Select what was typed, or save it as a group. Raises `SelectionError`, and then nothing changes."""
        choice = parse_selection(text, known)
        if choice.save_as:
            self.groups[choice.save_as] = choice.ids
        if choice.save_as and not choice.ids:
            del self.groups[choice.save_as]
        self.set(choice.ids)
        return choice

    def step(self, by: int, fleet: Sequence[int]) -> None:
        """Go to the next or previous vehicle: of several selected ones look at it, else select it alone."""
        among = self.ids if len(self.ids) > 1 else tuple(fleet)
        if not among:
            return
        at = among.index(self.lead) + by if self.lead in among else (0 if by > 0 else -1)
        vehicle = among[at % len(among)]
        self.set(self.ids if len(self.ids) > 1 else (vehicle,), vehicle)
