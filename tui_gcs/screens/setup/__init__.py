"""The setup screen: airframe, sensors, radio, modes, failsafes, motors, battery and gains of the selected vehicles.

`SetupScreen` shows sections on the left and the lines of one on the right, of the selected vehicles or of all while
none is selected. `SetupEdits` asks before anything is changed, and leads calibrations by the vehicles' own prompts.

Always: only selected vehicles are changed; a motor turns on one vehicle at a time. What needs attention is judged by
the station (`core/requests/setup_overview.py`). Not here: parameters themselves (`screens/parameters`), drawing
(`widgets/setup`).
"""
