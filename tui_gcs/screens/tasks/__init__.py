"""The screen of tasks and people: what goes on and can be cancelled, who is connected, who holds control.

`TasksScreen` asks the station while it is shown, and not otherwise. Not here: drawing (`widgets/tasks`), who holds
control (`core/requests/people_requests.py`).
"""
