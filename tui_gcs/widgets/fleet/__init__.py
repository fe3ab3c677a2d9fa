"""Panels about vehicles and teams: roster, table and grid of the fleet, details, planners, and results of orders.

Entry classes: `Roster`, `FleetTable` and `FleetGrid` show all vehicles, `VehicleDetail` one, `PlannerPanel` the teams,
`ResultPanel` what came of orders. Screens call `show` with the latest data; a click posts `VehiclePicked`.

What always holds: vehicles in trouble are never scrolled out of sight without a count of them; values of a lost vehicle
are not shown as if they were still true; colour follows the alarm level alone (`severity_levels`).

Not here: how trouble is found (the station does), and what an operator can order (`actions`).
"""
