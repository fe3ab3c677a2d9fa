"""The traffic screen: tracks, ADS-B and Remote ID as seen from the fleet, and points of interest for planners.

`TrafficScreen` asks the station while it is shown, and not otherwise. Not here: distances and closest approaches
(`feed/traffic`), drawing (`widgets/traffic`), the alarm for aircraft nearby (the station's).
"""
