"""Plots of values over time: the scale, the curves as dots, and the pane around them.

`PlotPane` draws what it is given and knows neither stations nor files: live values and those of a flight look the same.
Why no plotting library draws them: `docs/decisions/0012-own-plots.md`.
"""
