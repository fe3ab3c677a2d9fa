"""The list of preflight checks, over any screen.

`PreflightScreen` shows every check with what to do, acknowledges failsafes, has the station read values again, and
signs the list with the operator's name (`Operator`), which the start dialog uses, too.

Always: the mark stays with its check, and a key that may be meant for the check before is refused.

Not here: the checks themselves (`core/preflight`), and overriding them at a start (`screens/fly/start_dialog`).
"""
