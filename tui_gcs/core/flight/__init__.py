"""Flight control: the phases of all vehicles of the teams, from take-off to landing.

`Executive` is the entry: start, hold, resume, return and land of vehicles, each with a result. `Steering` streams
set-points of courses that the guard has passed; `TeamController` stands between the station and one planner;
`ManualController` and `FollowController` give courses for operators; `ReturnController` brings vehicles home. The
station constructs them from one `FlightServices`, and ticks them; requests and the bus handlers call them.

What always holds: a hold interrupts everything and is never queued; no course is flown that the guard has not passed,
but holds and returns; a vehicle that is lost, replaced or in a foreign mode is sent nothing by itself.

Not here: how an autopilot is commanded (`firmware`), what leaves for a vehicle (`uplink`), what is safe (`guard`).
"""
