"""The fly screen and its dialogs: start, change of round, manual control, planners.

`FlyScreen` is what an operator watches while vehicles fly. `StartDialog` lists what would fly (`start_plan`) and asks
as gravely as the kind of run demands; `RoundDialog` switches the round; `ManualControlScreen` flies vehicles by
arrows.

Always: a confirmation is void when fleet, links or round have changed, and a question that is too old takes no
answer.

Not here: the start itself and HOLD ALL, which the console sends; the list of preflight checks (`screens/preflight`).
"""
