"""Ideal and bound of vehicles that differ are the same before, in and after a flight: on what sweeps together."""

import math

import pytest

from tests.core.rigs.rig import toml
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.firmware.own_limits import OwnLimits
from tui_gcs.core.flight.planner_tasks import crewed, crews, within_own_limits
from tui_gcs.core.flight.zone_idleness import ZoneIdleness
from tui_gcs.core.judging.zone_measure import ZoneMeasure
from tui_gcs.core.missions.scenario_findings import team_findings
from tui_gcs.core.protocol.common import FleetFrame
from tui_gcs.core.scenario.load import parse
from tui_gcs.planner.runtime.plan_forecast import forecast

SLOW = '\n[[class]]\nname = "slow"\nvehicles = [2]\nspeed_m_s = 5.0\nfootprint_radius_m = 12.0\n'
IDEAL_S = math.pi * 80.0**2 / ((3 * 8.0 + 5.0) * 2 * 12.0)
"""Each vehicle sweeps at its own speed; what counts as seen is the least footprint, for all."""


def test_all_that_print_an_ideal_print_the_same() -> None:
    scenario = parse(toml() + SLOW)
    round_, team = scenario.rounds[0], scenario.teams[0]
    task = crewed(scenario, round_, team, crews(scenario)[team.name])
    flown = within_own_limits(task, dict.fromkeys(task.members, OwnLimits(speed_m_s=6.0, accel_m_s2=2.0)))
    assert flown.limits.speed_m_s == 5.0, "planned is with the slowest"

    checked = team_findings(scenario, round_, team)[0].text
    live = ZoneIdleness(flown)
    measure = ZoneMeasure(scenario, round_, round_.zones[0], team.name, 0.0)
    measure._n = 4
    judged = measure.result()
    nobody = FleetFrame(seq=0, t_s=0.0, wall_s=0.0, kind=RunKind.SIM)
    planned = forecast(flown, nobody, {}, {v: (45.0, 170.0 + 20.0 * v) for v in task.members})

    assert f"ideal {IDEAL_S:.1f} s" in checked
    assert live.ideal_s(4) == planned.ideal_s == pytest.approx(IDEAL_S, rel=0.01)
    assert judged.ideal_s == pytest.approx(live.ideal_s(4), abs=0.01)
    assert judged.bound_s == pytest.approx(live.bound_s(4), abs=0.01) and planned.bound_s == live.bound_s(4)
    assert planned.plan.metrics["predicted_ratio"] == pytest.approx(planned.ratio)
