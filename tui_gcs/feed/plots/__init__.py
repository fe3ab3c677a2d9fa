"""What is plotted: values by name, their points over time, and the panes that show them.

`ValueRecorder` is filled by the console while it runs: one row a second of everything that is published, and every
point of what is plotted. `PlotSource` gives points to the screen, `PlotLayout` assigns values to panes.

Not here: drawing (`widgets/plots`), points of recorded flights (`core/records/flight_series.py`).
"""
