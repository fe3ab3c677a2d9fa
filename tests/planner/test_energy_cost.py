"""What planners are told about batteries, and what an intent takes of them."""

import math

import msgspec
import numpy as np
import pytest

from tui_gcs.core.scenario.model import PowerModel, VehicleClass
from tui_gcs.planner.api import Context, Intent, Tracks
from tui_gcs.planner.runtime.kinematic_fleet import KinematicFleet, scattered, task_for
from tui_gcs.planner.runtime.message_conversion import NO_TRACKS, team_view

QUAD = VehicleClass("quad", (1, 2), 8.0, 2.5, 15.0, PowerModel(capacity_wh=100.0, hover_w=360.0, cruise_w=180.0))
"""Uses 0.1 % of its battery in a second of hovering, 0.05 % at 8 m/s."""


def context(left_s: float = 800.0, home_s: float = 60.0, tracks: Tracks = NO_TRACKS) -> Context:
    """Two vehicles at 80 %: by the model of their class that lasts 800 s of hovering."""
    task = msgspec.structs.replace(task_for((1, 2), "own"), classes={1: QUAD, 2: QUAD})
    frame = KinematicFleet(task, scattered(2)).frame()
    frame = msgspec.structs.replace(frame, battery_left_s=(left_s, math.nan), home_s=(home_s, math.nan))
    return Context(frame.t_s, team_view(frame, task), np.random.default_rng(1), 0, 0.1, tracks, task=task)


def ahead(ctx: Context, distance_m: float) -> tuple[float, float, float]:
    x, y, z = ctx.fleet.position_m[0].tolist()
    return (x + distance_m, y, z)


def test_a_way_costs_what_its_time_takes_at_its_speed() -> None:
    ctx = context()
    assert ctx.cost_pct(Intent(1, "goto", position_m=ahead(ctx, 80.0), speed_m_s=8.0)) == pytest.approx(0.5)
    assert ctx.cost_pct(Intent(1, "goto", position_m=ahead(ctx, 80.0))) == pytest.approx(0.5)
    assert ctx.cost_pct(Intent(1, "goto", position_m=ahead(ctx, 80.0)), 30.0) == pytest.approx(0.5 + 2.0), (
        "hovers there"
    )
    assert ctx.cost_pct(Intent(1, "goto", position_m=ahead(ctx, 80.0)), 5.0) == pytest.approx(0.25), "on its way"
    assert ctx.cost_pct(Intent(1, "velocity", velocity_m_s=(8.0, 0.0, 0.0), valid_s=2.0)) == pytest.approx(0.1)


def test_a_trajectory_costs_what_is_left_of_it() -> None:
    ctx = context()
    places = tuple(ahead(ctx, 8.0 * k) for k in range(11))
    course = Intent(1, "trajectory", t0_s=ctx.t_s, dt_s=1.0, positions_m=places, velocities_m_s=((8.0, 0.0, 0.0),) * 11)
    assert ctx.cost_pct(course) == pytest.approx(0.5)
    assert ctx.cost_pct(msgspec.structs.replace(course, t0_s=ctx.t_s - 5.0)) == pytest.approx(0.25)
    assert ctx.cost_pct(msgspec.structs.replace(course, t0_s=ctx.t_s + 5.0)) == pytest.approx(1.0), "it hovers first"


def test_a_hold_and_an_orbit_need_a_duration_and_a_return_takes_the_way_home() -> None:
    ctx = context()
    assert ctx.cost_pct(Intent(1, "hold"), 10.0) == pytest.approx(1.0)
    orbit = Intent(1, "orbit", position_m=ahead(ctx, 20.0), radius_m=20.0, speed_m_s=8.0)
    assert ctx.cost_pct(orbit, 10.0) == pytest.approx(0.5)
    assert ctx.cost_pct(Intent(1, "return")) == pytest.approx(6.0)
    for endless in (Intent(1, "hold"), orbit):
        with pytest.raises(ValueError, match="has no end: give a duration"):
            ctx.cost_pct(endless)


def test_what_was_measured_corrects_the_model() -> None:
    """A battery that lasts half as long as its model says is used twice as fast."""
    assert context(left_s=400.0).cost_pct(Intent(1, "hold"), 10.0) == pytest.approx(2.0)


def test_what_is_unknown_is_nan_and_a_stranger_is_refused() -> None:
    ctx = context()
    assert math.isnan(ctx.cost_pct(Intent(2, "hold"), 10.0))
    assert math.isnan(context(home_s=math.nan).cost_pct(Intent(1, "return")))
    assert math.isnan(context(left_s=0.0).cost_pct(Intent(1, "hold"), 1.0))
    with pytest.raises(ValueError, match="vehicle 7 is not in the fleet"):
        ctx.cost_pct(Intent(7, "hold"), 1.0)


def test_frames_without_these_columns_are_of_unknown_energy() -> None:
    task = task_for((1, 2), "own")
    fleet = team_view(KinematicFleet(task, scattered(2)).frame(), task)
    assert np.isnan(fleet.battery_left_s).all()
    assert np.isnan(fleet.home_s).all()
