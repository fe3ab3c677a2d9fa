"""The widgets of the settings screen: the list, and a panel with all about the chosen setting.

Not here: keys, reading and writing the file (`screens/settings`).
"""
