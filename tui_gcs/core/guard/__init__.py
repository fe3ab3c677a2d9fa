"""The guard: run-time assurance of all courses that are flown, and the predictions it rests on.

`Guard.judge` is the entry: `flight.steering` asks it before a course's set-points are sent, and again every 0.2 s;
`Uplink.action` asks `Guard.judge_action` before an order leaves. It passes or vetoes, and never changes what is asked.
The idea is ASTM F3269: a small trusted monitor around functions that are not proven, planners above all.

What always holds: a vehicle that brakes now comes to rest inside the region and apart from all others, and a course
passes only if that is still true after it was flown until it is judged again. Stops are never vetoed; what leads back
inside, or apart, passes. Every branch is reached by unit tests, and mutation tests (`tests/mutants.py`) check those.

Not here: what a vetoed vehicle does (`flight.steering` holds it), alarms about others (`judging`), set-points
(`uplink`).
"""
