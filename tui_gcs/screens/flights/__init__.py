"""The flights screen: recordings, what happened in them, replay, export; and the screen of logs on vehicles.

`FlightsScreen` lists what is on this computer's disk (`core/records/flight_archive.py`); `VehicleLogsScreen` lists what
vehicles hold, and downloads it. Files are read in threads, never on the event loop. Not here: drawing
(`widgets/flights`), reading of files (`core/records`, `core/judging/flight_timeline.py`), plots of values.
"""
