"""Orders to the selected vehicles: the menu, and the dialog that asks before one is sent.

`OrderMenu` returns the order that was chosen. `OrderDialog` asks for its values and for the confirmation that its
grade demands; it returns a `ConfirmedOrder`, or why nothing is sent. The console sends the order and follows its
results.

Always: nothing but a stop is sent when a vehicle has changed since the question was asked, and a question expires.

Not here: which orders exist and what they need (`actions/orders`), what came of them (`feed`, `widgets/fleet`).
"""
