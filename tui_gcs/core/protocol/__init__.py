"""The bus and every message on it: what the programs of tui-gcs say to each other.

Entry points: `bus.Bus` (the interface; `zenoh_bus` between processes, `MemoryBus` in lock-step and tests), `common`
(status, requests, replies) and `services` (requests about vehicles). All programs import it: station, consoles,
workers, clients.

What always holds: a message is a msgspec struct that is declared once; unknown fields and wrong types are errors;
the principal stands in the bus key, never in a payload; programs decide by fields and codes, never by the text of a
reply. A change of a struct raises `common.PROTOCOL`.

Not here: MAVLink (`core/mavlink`), and how a request is carried out (`core/requests`).
"""
