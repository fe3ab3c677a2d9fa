"""What the guard's tests share: a square area of 200 m, 5 m margin, band 20-90 m; 8 m/s, 2.5 m/s²."""

import numpy as np

from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Shape, Zone
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.motion_prediction import MotionModel, VehicleState
from tui_gcs.core.guard.permission import Verdict
from tui_gcs.core.motion.course import Course, PositionTarget, Trajectory
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.scenario.model import Limits, OperatingArea

LIMITS = Limits()
SQUARE = Rectangle(centre_m=(100.0, 100.0), width_m=200.0, height_m=200.0)
L_SHAPE = Polygon(vertices_m=((0.0, 0.0), (200.0, 0.0), (200.0, 60.0), (60.0, 60.0), (60.0, 200.0), (0.0, 200.0)))
POND = Zone(name="pond", role=Role.NO_FLY, shape=Circle(centre_m=(100.0, 100.0), radius_m=20.0))


def guard(shape: Shape = SQUARE, *no_fly: Zone) -> Guard:
    return Guard(LIMITS, OperatingArea(shape, 20.0, 90.0), no_fly)


def sight(
    position: Vec3, course: Course | None = None, velocity: Vec3 | None = None, id_: int = 1, column: bool = False
) -> VehicleState:
    """A vehicle that follows its course, as fast as that; without one it flies straight on."""
    if velocity is None:
        velocity = course.at(0.0)[1] if course is not None else (0.0, 0.0, 0.0)
    motion = MotionModel.DRIFTS if course is None else MotionModel.FOLLOWS
    return VehicleState(id_, position, velocity, motion, course, in_column=column)


def judge(g: Guard, me: VehicleState, *others: VehicleState, now: float = 0.0) -> Verdict:
    assert me.course is not None
    return g.judge([me], [me.course], list(others), now)[0]


def stand(x: float, y: float, z: float = 40.0) -> PositionTarget:
    return PositionTarget((x, y, z), LIMITS.speed_m_s)


def passing(x: float, y: float, vx: float, vy: float = 0.0, z: float = 40.0) -> Trajectory:
    """At (x, y) now with this velocity, straight on for 10 s."""
    t = np.arange(0.0, 10.5, 0.5)[:, None]
    velocity = np.array([[vx, vy, 0.0]])
    return Trajectory(0.0, 0.5, np.array([[x, y, z]]) + t * velocity, np.repeat(velocity, len(t), axis=0))


def verdict(g: Guard, position: Vec3, course: Course, *others: VehicleState, now: float = 0.0) -> str:
    return judge(g, sight(position, course), *others, now=now).code
