"""MAVFTP and log transfers: jobs that move files between vehicles and this station.

`FtpService` (ftp.py) and `LogService` (logs.py) submit the jobs; the station's request handlers call them, and the
services for parameters and component metadata read files through `FtpSessions`. The layers, from the wire up:
`ftp_codec` (packets), `FtpDialogue` (one request at a time), `FtpReader` and its siblings (one file), jobs.

What always holds: one dialogue per vehicle; no announced size is believed; a download is bounded, and lies below the
state directory under a name made here. A partial log is resumed. Which folders and virtual files an autopilot has is
not here, but in `core/firmware`.
"""
