"""The inspector: every message of every vehicle and component, its fields live, and what was dropped and why.

`InspectorScreen` asks the station for what it receives while it is shown, and not otherwise; `MessageRates` asks
vehicles for messages at a rate.

Always: looking sends nothing to a vehicle. Not here: the requests (`feed/message_inspection.py`), drawing
(`widgets/inspect`).
"""
