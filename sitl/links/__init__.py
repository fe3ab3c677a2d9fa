"""MAVLink frames on the wire, their signatures, and what bad links do to datagrams.

`wire.Encoder` and `wire.cut` are the entry for frames; `common.outbox` and `common.autopilot` call them.
`signing.Signer` signs and checks frames as autopilots do. Rehearsals and `launch.proxy` send datagrams through
`faults.FaultyLink`; `python -m sitl.links.faults TEXT` checks the text of a `--fault` option.

What always holds: no socket and no clock. Bytes and times come in with a call, bytes go out, and the same seed loses
the same datagrams. Whatever is not a good frame of a known message is skipped.

Not here: which messages a vehicle obeys (`common.autopilot`), and sockets (`launch`).
"""
