"""Message rates: which telemetry each vehicle sends and how often, within each link's byte budget.

`RateController` is the entry: the station ticks it, and it requests every message of a link's present set from every
vehicle there (SET_MESSAGE_INTERVAL), again while a vehicle does not comply. `LinkRates` holds one link: its vehicles,
its set on the ladder of `message_sets`, its request rate limit. `BackOff` steps down while a radio's buffer is full.

What always holds: every set contains all that the station acts on, only at other rates; a poorer set is chosen at once,
a richer one after a calm time; HIGH_LATENCY2 links are asked nothing.

Not here: reading telemetry (`fleet`), the commands' retries (`uplink`).
"""
