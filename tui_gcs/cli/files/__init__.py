"""The verbs of `tui-gcs check`, `convert` and `scenario`: files of scenarios, plans, drawings and parameters.

`parser.add` declares their arguments; `check.run` and `convert.run` are called by `cli.main`. Formats are read and
written by `core.formats`, findings are made by `core.missions`; here they become lines and exit codes.

Always true: a file that exists is replaced only with `--force`, and written as a whole or not at all.
"""
