"""What flies beside the fleet: tracks of its sensors, ADS-B and Remote ID, compared with every vehicle of the fleet.

`ContactWatch` asks the station for what is not in the fleet frame; `contacts` makes one list of all. Not here: the
alarm for aircraft nearby, which the station raises (`core/station/alarm_finder.py`).
"""
