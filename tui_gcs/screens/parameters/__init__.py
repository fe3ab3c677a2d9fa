"""The parameters screen: parameters of the fleet side by side, searched, compared, set, copied, saved and loaded.

`ParametersScreen` shows the parameters of the selected vehicles, or of the whole fleet while none is selected, and
which vehicles differ. `ChangeDialog` asks before anything is set.

Always: only selected vehicles are changed, and each change is listed with its vehicles before it is sent. Every change
can be taken back. Nothing is read from a vehicle unasked.

Not here: comparing (`feed/fleet_parameters.py`), requests (`feed/parameter_transfers.py`), drawing
(`widgets/parameters`).
"""
