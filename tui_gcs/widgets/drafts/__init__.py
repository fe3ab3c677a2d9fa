"""What both editing screens share: the map that takes keys, and saving a working copy.

`DraftMap` posts moves and clicks. `SaveFlow` decides what each press of the save key does for a `WorkingCopy`, and
`SaveBar` asks for a path where it must; `file_writer` writes a file so that a crash leaves the old one or the new
one.

Always: no file is overwritten at the first press, and none inside the installed package is written.

Not here: the working copies themselves (`widgets/plan`, `widgets/missions`), autosave (`core/base`).
"""
