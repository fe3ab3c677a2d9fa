"""The widgets of the planner log screen: the list of lines, and a panel that shows the chosen one whole.

Always: what a planner prints is drawn as text, never as markup. Not here: keys and requests (`screens/logs`).
"""
