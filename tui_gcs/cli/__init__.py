"""The command line: the subcommands of `tui-gcs`.

`main.main` parses the arguments and runs one subcommand; each stands in a module of its own, which is imported only
when it is asked for, so that `tui-gcs --help` is instant. `files/`, `planner/` and `vehicle/` hold the verbs of
`check`, `convert`, `planner …` and `vehicle …`.

Always true: an error that the user can cause is one line on stderr and exit code 2 (`exit_codes.CommandError`); nothing
shows a traceback. Not here: what the verbs do, which is `client`, `rehearsal`, `console` and `core`.
"""
