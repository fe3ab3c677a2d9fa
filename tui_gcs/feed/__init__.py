"""The console's one connection to the bus: samples become Textual messages, requests become replies.

Entry class: `Feed`, opened by the app on its event loop. It keeps the latest picture (`frame`, `status`, `scenario`,
`annotations`), posts the messages of `messages` to screens and widgets, and owns the parts behind it: `requests`
(everything that is asked of the station), `selection`, `events`, `notes` and `inspection`.

What always holds: bus callbacks only fill the `Mailbox` and wake the loop; everything else runs on the loop. A message
is posted only when something visible changed, and never while the terminal lags. Events are posted in order, none
missing. A stop that was sent is repeated until it is answered or replaced.

Not here: widgets, screens and what is drawn; what an action is (`actions`); the bus itself (`core.protocol`).
"""
