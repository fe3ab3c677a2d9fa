"""The widgets of the inspector: the list of messages, the list of what was dropped, and the fields of one message.

`MessageList` shows a line for each kind of message, `DroppedList` one for each reason, `MessagePanel` the newest frame.

Always: text of a vehicle is drawn as text, never as markup. Not here: keys and requests (`screens/inspect`), rates
(`feed/message_inspection.py`).
"""
