"""What can be switched on and off on a map. Vehicles and the operating area cannot."""

from enum import StrEnum


class Layer(StrEnum):
    """One kind of drawing, by the word an operator knows it by."""

    GRID = "grid"
    TRAILS = "trails"
    PLANS = "tours"
    TRACKS = "targets"
    PLACES = "take-off places"
    TRAFFIC = "traffic"
    OVERLAYS = "overlays"
    GOALS = "places flown to"
    ON_BOARD = "plans on board"


HIDDEN_AT_FIRST = frozenset({Layer.GRID})
