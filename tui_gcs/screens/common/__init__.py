"""What several screens share: base classes of screens and dialogs, help, palette, the tiny screen.

`MapScreen` binds the keys of a map; `DraftScreen` is the base of the two editing screens, with `KeyFeedback` for what
a key did and for second presses. `TextDialog` is the base of all dialogs: lines in a box that never covers alarms.

Always: a dialog ends once, even when a timer and a key come together. When no key closed it, the app drops the keys
that were still meant for it.

Not here: dialogs of one mode (in its folder), dialogs of orders (`screens/orders`).
"""
