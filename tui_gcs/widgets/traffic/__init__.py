"""The lists of the traffic screen, and the panel of the chosen row.

`ContactList` shows what flies beside the fleet as seen from the nearest vehicle, `PointList` the points of interest for
planners. They draw what they are given. Not here: how distances are found (`feed/traffic`), keys (`screens/traffic`).
"""
