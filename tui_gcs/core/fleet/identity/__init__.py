"""Identity of vehicles: which frames come from which vehicle, over which paths.

`paths.PathSelector` is the entry: it accepts or refuses paths, picks the one in use, and finds two vehicles with one
system id; `fleet.VehicleRegistry` calls it for each new path and at its tick. Evidence comes from `boot_clock`,
`path_correlation`, `path_rules` and `identity_checks`; `duplicate_filter` counts frames of several paths once, and
`unconfirmed_systems` lists systems that sent heartbeats only. Nothing here sends: due requests are returned. Signatures
are checked in `core/signing`. Threats: docs/threats.md B.6-19…26.
"""
