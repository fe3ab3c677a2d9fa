"""MAVLink: the codec, from bytes to the newest frame of each message, and from fields to frames.

`intake.Intake` is the entry for received bytes (one per network, made by the vehicle registry): it cuts, checks and
routes frames into `sources.Slot`s. `encode.Encoder` makes frames; `dialect` holds layouts and decodes fields; `signing`
computes and checks signatures. `mode_names`, `enum_names`, `failsafe_texts` and `commands` are names and numbers.
Nothing here knows vehicles, does I/O on links or reads a clock. Text fields are always cleaned (`SafeText`). Not here:
sockets (core/links), which vehicle a frame belongs to (core/fleet), key management (core/signing).
"""
