"""Forwarding: telemetry to other ground stations, and their commands as far as they pass the checks.

`Forwarder` is the entry: the reception feeds it what vehicles sent, and the station ticks it. `command_rules.judge` is
the allow-list of messages and commands; `request_checks` checks places, heights, speeds and separation with the guard;
`mission_rules` checks missions item by item and keeps what is on board; `parameter_rules` protects parameters.

What always holds: only frames on the allow-list pass, each for one named vehicle, and only through the uplink; what
cannot be read with certainty is refused; heartbeats, set-points and keys of other stations never pass.

Not here: our own commands (`uplink`, `flight`), how an autopilot reads a command (`firmware.foreign_command_policy`).
"""
