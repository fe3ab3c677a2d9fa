"""The vehicles screen: the whole fleet as a grid of cells or as a sorted table.

`VehiclesScreen` filters and sorts the fleet and shows the details of the selected vehicle beside or below it.

Always: figures that flicker are written at most twice a second. The size of the fleet decides between grid and table
until the operator does.

Not here: cells, table and detail panel (`widgets/fleet`).
"""
