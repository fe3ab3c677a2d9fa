"""The layers of a map, which can be switched on and off. Vehicles and the operating area cannot."""

from enum import StrEnum


class Layer(StrEnum):
    """One kind of drawing, by the word that the operator sees."""

    GRID = "grid"
    TRAILS = "trails"
    PLANS = "tours"
    TRACKS = "targets"
    PLACES = "take-off places"
    TRAFFIC = "traffic"
    OVERLAYS = "overlays"
    GOALS = "places flown to"
    ON_BOARD = "plans on board"
    TEAMS = "team names"
    BASE_MAP = "base map"


HIDDEN_AT_FIRST = frozenset({Layer.GRID, Layer.TEAMS})
