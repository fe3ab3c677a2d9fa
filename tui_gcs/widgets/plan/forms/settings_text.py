"""The fields of the settings form as texts, and the parts of a scenario that they mean. Independent of Textual.

Fields that belong together (a group) are checked together: half a position may lie where no place is allowed.
"""

from collections.abc import Mapping

import msgspec

from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.scenario.model import BatteryLimits, Limits, ResultLimits, Round, Scenario, TakeOffPlace
from tui_gcs.widgets.forms.form_text import FieldError, number_text, shown, to_number

Texts = Mapping[str, str]

DEGREE_DIGITS = 7
"""Decimals of latitudes and longitudes: about a centimetre."""
MAX_SEED = 2**63 - 1
MAX_ID_DIGITS = 4

SCENARIO, ORIGIN, ROUND, PLACE, LIMITS, BATTERY, RESULTS, LOSS = (
    *("scenario", "origin", "round", "place", "limits", "battery", "results", "link_loss"),
)
LIMIT_FIELDS = Limits.__struct_fields__
BATTERY_FIELDS = BatteryLimits.__struct_fields__
FILE_ONLY_RESULTS = ("cover_ratio_max", "intruders_met_min", "tasks_done_min", "metrics")
"""Gates of single kinds of planners: they are set in the file."""
RESULT_FIELDS = tuple(name for name in ResultLimits.__struct_fields__ if name not in FILE_ONLY_RESULTS)
FIELDS: dict[str, tuple[str, ...]] = {
    SCENARIO: ("scenario_name", "seed", "footprint_radius_m"),
    ORIGIN: ("lat_deg", "lon_deg", "ground_amsl_m"),
    ROUND: ("round_name", "duration_s"),
    PLACE: ("vehicle", "place_east_m", "place_north_m", "layer_m"),
    LIMITS: LIMIT_FIELDS,
    BATTERY: BATTERY_FIELDS,
    RESULTS: RESULT_FIELDS,
    LOSS: ("resume",),
}
"""The fields of each group."""
GROUP_OF = {field: group for group, fields in FIELDS.items() for field in fields}
YES, NO = "yes", "no"


def settings_text(scenario: Scenario, round_index: int, place_index: int) -> dict[str, str]:
    """Return all fields by name; those of a take-off place are missing if there is none."""
    current, origin = scenario.rounds[round_index], scenario.origin
    texts = {
        "scenario_name": scenario.name,
        "seed": str(scenario.seed),
        "footprint_radius_m": number_text(scenario.footprint_radius_m),
        "lat_deg": degrees_text(origin.lat_deg),
        "lon_deg": degrees_text(origin.lon_deg),
        "ground_amsl_m": number_text(origin.ground_amsl_m),
        "round_name": current.name,
        "duration_s": number_text(current.duration_s),
        "resume": YES if scenario.link_loss.resume else NO,
    }
    texts |= {name: number_text(getattr(scenario.limits, name)) for name in LIMIT_FIELDS}
    texts |= {name: number_text(getattr(scenario.battery, name)) for name in BATTERY_FIELDS}
    texts |= {name: number_text(getattr(scenario.results, name)) for name in RESULT_FIELDS}
    return texts | (place_text(scenario.places[place_index]) if scenario.places else {})


def place_text(place: TakeOffPlace) -> dict[str, str]:
    """Return the fields of a take-off place."""
    east, north = map(number_text, place.place_m)
    vehicle = str(place.vehicle) if place.vehicle is not None else ""
    return {"vehicle": vehicle, "place_east_m": east, "place_north_m": north, "layer_m": number_text(place.layer_m)}


def degrees_text(value: float) -> str:
    """Format degrees to about a centimetre, without trailing zeros."""
    return f"{round(value, DEGREE_DIGITS) + 0.0:.{DEGREE_DIGITS}f}".rstrip("0").rstrip(".")


def to_scenario(texts: Texts, old: Scenario) -> Scenario:
    """Return `old` with the typed name, seed and footprint. Raises FieldError."""
    if not texts["scenario_name"].strip():
        raise FieldError("name: nothing; must be 1 to 64 printable characters")
    seed = texts["seed"].strip()
    # `int` takes digits of any script, and takes long for a number of thousands of digits.
    if not seed.isascii() or not seed.isdecimal() or len(seed) > len(str(MAX_SEED)) or int(seed) > MAX_SEED:
        raise FieldError(f"seed: {shown(seed)} is not allowed; must be a whole number from 0 to {MAX_SEED}")
    footprint_m = to_number(texts["footprint_radius_m"], "footprint_radius_m", old.footprint_radius_m)
    return msgspec.structs.replace(old, name=texts["scenario_name"], seed=int(seed), footprint_radius_m=footprint_m)


def to_origin(texts: Texts, old: Origin) -> Origin:
    """Return the typed origin. Raises FieldError."""
    return Origin(
        _to_degrees(texts["lat_deg"], "lat_deg", old.lat_deg),
        _to_degrees(texts["lon_deg"], "lon_deg", old.lon_deg),
        to_number(texts["ground_amsl_m"], "ground_amsl_m", old.ground_amsl_m),
    )


def to_round(texts: Texts, old: Round) -> Round:
    """Return `old` with the typed name and duration. Raises FieldError."""
    if not texts["round_name"].strip():
        raise FieldError("round name: nothing; must be 1 to 32 printable characters")
    duration_s = to_number(texts["duration_s"], "duration_s", old.duration_s)
    return msgspec.structs.replace(old, name=texts["round_name"], duration_s=duration_s)


def to_place(texts: Texts, old: TakeOffPlace) -> TakeOffPlace:
    """Return the typed take-off place; without a vehicle it is for any vehicle. Raises FieldError."""
    vehicle = texts["vehicle"].strip()
    if vehicle and not (vehicle.isascii() and vehicle.isdecimal() and len(vehicle) <= MAX_ID_DIGITS):
        raise FieldError(f"vehicle: {shown(vehicle)} is no system id; must be one like 7, or nothing for any vehicle")
    place_m = (
        to_number(texts["place_east_m"], "place E", old.place_m[0]),
        to_number(texts["place_north_m"], "place N", old.place_m[1]),
    )
    layer_m = to_number(texts["layer_m"], "layer_m", old.layer_m)
    return TakeOffPlace(place_m, layer_m, int(vehicle) if vehicle else None)


def to_limits(texts: Texts, old: Limits) -> Limits:
    """Return the typed limits. Raises FieldError."""
    return Limits(**{name: to_number(texts[name], name, getattr(old, name)) for name in LIMIT_FIELDS})


def to_battery(texts: Texts, old: BatteryLimits) -> BatteryLimits:
    """Return when vehicles return for their batteries, as typed. Raises FieldError."""
    return BatteryLimits(**{name: to_number(texts[name], name, getattr(old, name)) for name in BATTERY_FIELDS})


def to_results(texts: Texts, old: ResultLimits) -> ResultLimits:
    """Return the typed limits of a good run. Raises FieldError."""
    typed = {name: to_number(texts[name], name, getattr(old, name)) for name in RESULT_FIELDS}
    return msgspec.structs.replace(old, **typed)


def _to_degrees(text: str, name: str, old: float) -> float:
    return old if text == degrees_text(old) else to_number(text, name)
