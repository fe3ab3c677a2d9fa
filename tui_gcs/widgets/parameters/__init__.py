"""The widgets of the parameters screen: the list that compares vehicles, and the details of one parameter.

`ParameterList` shows a line for each parameter, `ParameterDetail` its meaning, limits and the value of every vehicle.

Always: text of a vehicle is drawn as text, never as markup. Values are compared by `feed/fleet_parameters.py`; these
widgets only draw. Not here: keys and requests (`screens/parameters`).
"""
