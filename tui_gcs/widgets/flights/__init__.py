"""The widgets of the flights screen and of the screen of vehicles' logs: lists, and a panel for the chosen row.

Always: text of a vehicle or of a file is drawn as text, never as markup. Not here: keys, files and requests
(`screens/flights`).
"""
