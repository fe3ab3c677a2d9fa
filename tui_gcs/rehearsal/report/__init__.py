"""The report of a rehearsal: one HTML file that any browser shows without a network.

Entry: `flight_recording.FlightRecord` records a flight from the bus, `page.page` makes the file. `maps` draws zones and
paths, `svg` charts and heat maps.

What always holds: texts from outside are escaped, and the file needs no script and no other file. The checks that the
report lists come from the referee in `tui_gcs/core/judging/`.
"""
