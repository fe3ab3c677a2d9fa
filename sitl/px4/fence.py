"""PX4's fence: the shapes of the stored plan that have passed their checks."""

from sitl.common.fence import Shape, shapes_of
from sitl.common.missions import Plans
from sitl.physics.point_masses import Body, Point


class Px4Fence:
    """The fence in force of one vehicle."""

    def __init__(self, plans: Plans, body: Body) -> None:
        self._plans, self._body = plans, body
        self._shapes: tuple[Shape, ...] | None = None

    @property
    def exists(self) -> bool:
        """Whether any shape is in force."""
        return bool(self._plans.in_force)

    def changed(self) -> None:
        """Drop the shapes, because the plan has changed: they are read again when they are next needed."""
        self._shapes = None

    def allows(self, place_m: Point) -> bool:
        """Return whether the vehicle may be at a place."""
        if self._shapes is None:
            self._shapes = tuple(shape for items in self._plans.in_force for shape in shapes_of(items, self._body))
        return all(shape.allows(place_m[0], place_m[1]) for shape in self._shapes)
