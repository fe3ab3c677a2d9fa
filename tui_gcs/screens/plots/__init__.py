"""The plots screen: values of vehicles and teams over time, live or of a recorded flight.

`PlotScreen` has panes and keys for any source of points; `LivePlotsScreen` is that of a console. While it is not shown
nothing is asked of the station; published values are recorded once a second, those that are plotted as they come.

Not here: drawing (`widgets/plots`), what there is to plot (`feed/plots/plotted_values.py`), reading flights
(`core/records/flight_series.py`).
"""
