"""The fleet: every vehicle that is heard, its newest telemetry, and how far both can be trusted.

`fleet.VehicleRegistry` is the entry: the station feeds it frames through its intakes, ticks it, and reads `vehicles`.
`telemetry` decodes into `vehicle.VehicleTelemetry`; `identity/` decides which frames belong to which vehicle, and
`integrity/` whether reported values hold. `tracks` and `detections` are the targets that vehicles see, `wind` their
wind estimates, `status_text` their texts. A value that is not finite or not plausible never leaves this package. Not
here: sending (core/uplink), judging of flights (core/judging), what is published (core/station).
"""
