"""Results: whether a flight did what it should, and what a log of a flight holds.

Entry classes: `referee.Referee` measures a flight from what the station publishes, and nothing else: with one
`zone_measure.ZoneMeasure` for each team and round, which counts seen and unseen cells on an `IdlenessGrid`, and one
`flight_measure.FlightMeasure` for all vehicles. Its result is a `flight_result.FlightResult`. `mission_script.Script`
flies a whole mission without a person; `incursions` counts intruders, `team_separation` compares the forecasts of
teams, `tlog_summary` reads telemetry logs. Rehearsals, `tui-gcs run` and the planner check call them.

What always holds: what is measured here never steers anything; a value that fails is never rounded to one that
passes.

Not here: the monitor that counts separation in flight (`core/flight/fleet_monitor.py`), and the report pages.
"""
