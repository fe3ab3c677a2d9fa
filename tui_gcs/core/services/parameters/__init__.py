"""The parameter protocol: reading, setting and fetching the parameters of vehicles.

`ParamService` is the entry; request handlers, the failsafe service and the setup services call it. `read` and `set`
work at any time, beside any job. `fetch_all` is a job, because it takes a radio's time; nothing is fetched unasked.
`ParamChange` changes several parameters and can undo that.

What always holds: a value is exact on the wire or refused; a setting counts only when the vehicle reported the value;
tables are bounded, and forgotten at a reboot. How an autopilot encodes values and which ways of fetching it has is not
here, but in `core/firmware/parameter_transport`.
"""
