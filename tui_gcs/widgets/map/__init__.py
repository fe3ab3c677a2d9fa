"""The map widget: round, tours, trails, vehicles, targets and traffic, in braille or ASCII.

`MapView` takes state by setters and writes only the rows that changed. `MapPainter` paints a `MapContent`: lines into
a `DotRaster`, signs and words into `Cells`. `Viewport` converts metres to dots and back. The fly, plan and missions
screens use it.

Always: everything can be read without colour, vehicles cannot be hidden, and what does not move is painted once for
each view.

Not here: what a screen draws by itself (it passes `MapLine` and `MapWord`), and editing (`widgets/drafts`,
`widgets/plan`).
"""
