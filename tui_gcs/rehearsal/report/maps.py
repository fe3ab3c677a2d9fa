"""Maps of a flight: a panel per round with zones, tours and vehicles, and a map with all that was flown in a round."""

from html import escape

from tui_gcs.core.geometry.zones import Role, bounds, outline_m
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.rehearsal.report.flight_recording import FlightRecord, RoundRecord
from tui_gcs.rehearsal.report.svg import COLOURS, SvgMap

MARGIN_M = 15.0
PANEL_WIDTH, WIDTH = 420, 760
TRAIL_SAMPLES = 20
"""Samples of a path that a panel shows, a second each."""
ZONE_STYLE = {
    Role.DEFEND: 'fill="#0072b2" fill-opacity="0.10" stroke="#0072b2" stroke-width="2"',
    Role.ATTACK: 'fill="#d55e00" fill-opacity="0.10" stroke="#d55e00" stroke-width="2"',
    Role.NO_FLY: 'fill="#000000" fill-opacity="0.25" stroke="#000000" stroke-width="2"',
}


def mission_figure(record: FlightRecord) -> str:
    """Return one panel per flown round: where vehicles were when it ended, and where they came from."""
    panels = [_panel(record, one, "abcdefghijklmnopqrstuvwxyz"[i % 26]) for i, one in enumerate(record.rounds)]
    return f'<div class="rounds">{"".join(panels)}</div>' if panels else "<p>Nothing was flown.</p>"


def flown_map(scenario: Scenario, one: RoundRecord) -> SvgMap:
    """Return a map of all that was flown in a round."""
    return _map(scenario, one, WIDTH, None)


def _panel(record: FlightRecord, one: RoundRecord, letter: str) -> str:
    end_s = max((t for zone in one.zones for t in zone.times_s), default=one.begin_s - record.begin_s)
    lost = len(one.paths_m) - len(one.flying)
    gone = f", {lost} lost or left on the way" if lost else ""
    caption = f"({letter}) {one.round.name}, T+{end_s:.0f} s: {len(one.flying)} vehicles fly{gone}"
    picture = _map(record.scenario, one, PANEL_WIDTH, TRAIL_SAMPLES)
    return f"<figure>{picture}<figcaption>{escape(caption)}</figcaption></figure>"


def _map(scenario: Scenario, one: RoundRecord, width: int, trail: int | None) -> SvgMap:
    """Draw a round; `trail` is the number of newest path samples to draw, None for all."""
    x0, y0, x1, y1 = bounds(one.round.area.shape)
    title = f"map of {one.round.name}"
    picture = SvgMap(title, (x0 - MARGIN_M, y0 - MARGIN_M), (x1 + MARGIN_M, y1 + MARGIN_M), width)
    picture.polygon(outline_m(one.round.area.shape), 'fill="none" stroke="#7f8a94" stroke-dasharray="8 5"')
    for zone in one.round.zones:
        picture.polygon(outline_m(zone.shape), ZONE_STYLE[zone.role])
        left, _, _, top = bounds(zone.shape)
        picture.text(left, top + 4.0, f"{zone.role} {zone.name}")
    for team in one.zones:
        picture.path(team.tour_m, 'stroke="#1c2126" stroke-width="1" stroke-dasharray="2 3"')
    for place in scenario.places:
        picture.text(*place.place_m, "+", 'text-anchor="middle"')
    for number, vehicle in enumerate(sorted(one.paths_m)):
        colour, path = COLOURS[number % len(COLOURS)], one.paths_m[vehicle]
        there = vehicle in one.flying
        drawn = path if trail is None else path[-trail:] if there else []
        picture.path(drawn, f'stroke="{colour}" stroke-width="{1.2 if trail is None else 2.2}" stroke-opacity="0.65"')
        (picture.dot if there else picture.cross)(*path[-1], colour)
        picture.text(path[-1][0] + 4.0, path[-1][1], str(vehicle), 'font-weight="700"')
    return picture
