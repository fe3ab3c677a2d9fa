"""The widgets of the screen of tasks and people: two lists, and a panel that shows the chosen row whole.

Always: text of a vehicle is drawn as text, never as markup. Not here: keys and requests (`screens/tasks`).
"""
