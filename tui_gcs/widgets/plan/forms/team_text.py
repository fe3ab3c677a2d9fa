"""The fields of the team form as texts, and the team that they mean. Independent of Textual."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tui_gcs.core.scenario.model import Team
from tui_gcs.planner.api import Param, ParamValue
from tui_gcs.widgets.forms.form_text import FieldError, ids_text, number_text, shown, to_ids, to_number

YES, NO = "yes", "no"


@dataclass(frozen=True)
class TeamText:
    """The texts in the fields. An empty parameter stands for the planner's default."""

    name: str = ""
    vehicles: str = ""
    count: str = ""
    zone: str = ""
    planner: str = ""
    parameters: Mapping[str, str] = field(default_factory=dict)
    new_name: str = ""
    """The new name of the team; "" to keep the old one."""


def team_text(team: Team) -> TeamText:
    """Return the fields of a team."""
    parameters = {name: value_text(value) for name, value in team.parameters.items()}
    count = str(team.count) if team.count else ""
    return TeamText(team.name, ids_text(team.vehicles), count, team.zone, team.planner, parameters)


def to_team(texts: TeamText, old: Team, params: Sequence[Param]) -> Team:
    """Return the team that the fields mean; `old` is what they were filled from. Raises FieldError."""
    vehicles = to_ids(texts.vehicles, "vehicles")
    count = _to_count(texts.count)
    if vehicles and count:
        raise FieldError("vehicles and count are both given; must be ids or a count, not both")
    if not vehicles and not count:
        raise FieldError("neither vehicles nor count is given; must be ids like 1-4, or a count")
    known = {param.name: param for param in params}
    parameters: dict[str, ParamValue] = {}
    if texts.planner == old.planner:
        # Parameters that are not declared here may be another program's: they are kept.
        parameters = {name: value for name, value in old.parameters.items() if name not in known}
    for name, text in texts.parameters.items():
        if name in known and text.strip():
            value = to_value(known[name], text, old.parameters.get(name))
            # A choice is never empty, so its default would be stored by every edit.
            if name in old.parameters or value != known[name].default:
                parameters[name] = value
    return Team(
        texts.new_name or texts.name,
        texts.zone,
        texts.planner,
        vehicles,
        count,
        _in_old_order(parameters, old.parameters),
    )


def value_text(value: ParamValue) -> str:
    """Return a parameter's value as it stands in its field."""
    if isinstance(value, bool):
        return YES if value else NO
    return number_text(value) if isinstance(value, float) else str(value)


def to_value(param: Param, text: str, old: ParamValue | None = None) -> ParamValue:
    """Return the value that `text` means, checked against the parameter's declaration. Raises FieldError."""
    value: ParamValue
    if param.type is bool:
        value = text == YES
    elif param.type is int:
        try:
            value = int(text.strip())
        except ValueError:
            raise FieldError(f"{param.name}: {shown(text)} is not a whole number; {allowed(param)}") from None
    elif param.type is float:
        value = to_number(text, param.name, float(old) if isinstance(old, int | float) else None)
    else:
        value = text
    if param.problem(value):
        raise FieldError(f"{param.name}: {shown(text)} is not allowed; {allowed(param)}")
    return value


def allowed(param: Param) -> str:
    """Return what may stand in a parameter's field."""
    if param.choices:
        return f"must be one of {', '.join(param.choices)}"
    unit = f" {param.unit}" if param.unit else ""
    low, high = param.minimum, param.maximum
    if low is not None and high is not None:
        return f"must be {low:g} to {high:g}{unit}"
    if low is not None:
        return f"must be at least {low:g}{unit}"
    if high is not None:
        return f"must be at most {high:g}{unit}"
    return f"must be {'a whole number' if param.type is int else 'a number' if param.type is float else 'text'}"


def _to_count(text: str) -> int:
    if not text.strip():
        return 0
    # `int` takes long for a number of thousands of digits, so only the first nine are looked at.
    if not text.strip().isdecimal() or not 1 <= int(text.strip()[:9]) <= 254:
        raise FieldError(f"count: {shown(text)} is not allowed; must be a whole number from 1 to 254")
    return int(text.strip()[:9])


def _in_old_order(parameters: dict[str, ParamValue], old: Mapping[str, ParamValue]) -> dict[str, ParamValue]:
    # In the order of the file, new ones at the end: a changed value changes one line.
    first = {name: parameters[name] for name in old if name in parameters}
    return first | parameters
