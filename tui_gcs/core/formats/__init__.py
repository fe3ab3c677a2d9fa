"""Files of other programs: plans, drawings and parameters, read, written and converted.

`file_types.read_file` recognises a file by its contents and returns a `Content`; `conversion.convert` turns a `Content`
or a scenario into the bytes of another format. The console's dialogs, `tui-gcs convert` and `check`, and map overlays
use them. There is one module for each format: `qgc_plan` and `qgc_write`, `wpl`, `plan_json`, `fence_rally_lists`,
`kml`, `geojson`, `params`; `drawings` and `scenario_drawings` turn plans and zones into drawings and back.

What always holds: input is limited in size, depth and number before it is used (`bounded`); every error is one line
with the place; what a format cannot hold is reported as left out. Nothing here opens a network address or talks to a
vehicle; drafts of this program are in `core/missions/draft_file`.
"""
