"""Records of a run: events, the journal, telemetry logs and past rehearsals.

`event_log.EventLog` numbers events for consoles and listeners; `journal.Journal` writes them and every command to disk,
and `journal_reader` reads them back. `tlog_writer` and `tlog_reader` are .tlog files; `rehearsal_store` holds which
plans were rehearsed. `appender.FileAppender` is what all writers share: it never raises and never blocks a flight
because of a disk. Not here: recovery of a station's state (core/station/state_store), formats of other programs
(core/formats).
"""
