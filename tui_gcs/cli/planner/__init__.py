"""The verbs of `tui-gcs planner`: new, list, check, watch and log, for the authors of planners.

`parser.add` declares their arguments; `cli.main` imports the module of the verb and calls its `run`. A planner's code
never runs in the process of the command, but in `check_child`, in a planner worker or in `planner.runtime.describe`,
any of which may hang or crash.

Not here: the checks themselves, which are `planner.check`; flights of a planner are in `check_flights`, because the
simulator may be used above `planner` only.
"""
