"""The screens of the console: layout and message handlers, one folder per mode.

The app adds one screen for each mode (fly, plan, missions, vehicles, journal) and pushes the dialogs. A screen gets
the feed, composes widgets, passes messages of the feed to them, and binds keys to actions. What it edits is in a
model below `widgets/` that knows no Textual; subjects of a large screen are controllers beside it.

Always: a screen imports widgets, feed and actions, never `console` or the app. The app sends commands to the fleet,
so that they work on every screen; a dialog returns what the operator confirmed, or why nothing is sent.

Not here: drawing (`widgets/`), tables of keys (`actions/`), requests and their answers (`feed/`).
"""
