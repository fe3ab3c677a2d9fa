"""Alarms: what is wrong now becomes what operators see, acknowledge and shelve (ISA-18.2).

Entry class: `alarm_table.AlarmTable`, which takes all findings of a moment and gives the alarms to show. `causes`
declares every cause with its level, delays, advice and consequences; `vehicle_findings` judges one vehicle by its
telemetry alone. The station calls it five times a second, a replay of a recording too.

What always holds: an alarm asks for an operator's act (anything else is an event); its order is the order of
importance; consequences of another alarm of the same vehicle are not shown; nothing here sends anything.

Not here: findings about the whole fleet and the station itself (`core/station/alarm_finder.py`).
"""
