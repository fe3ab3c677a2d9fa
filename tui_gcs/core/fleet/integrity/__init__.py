"""Integrity of telemetry: whether what a vehicle reports of its position, height, home and state can be relied on.

Each `…Monitor` looks at all vehicles at the station's tick and returns findings or keeps them for display:
`PositionJumpMonitor`, `AltitudeMonitor`, `NavigationIntegrityMonitor`. `home_check` and `position_error` are the rules
that `TelemetryDecoder` applies to single messages; `RebootStore` keeps which vehicles need a reboot before flight. The
monitors never command: the station holds a vehicle because of a finding.
"""
