"""tui-gcs: a ground control station for fleets of autonomous vehicles, in a terminal.

Four programs share this package: the station (`core.process`), planner workers (`planner.runtime.worker`), the console
(`app`) and the command line (`cli`), which starts and finds the others. They talk over a bus, never in one process.

The packages from the ground up: `core`, `planner`, `client`, `rehearsal`, `terminal`, `actions`, `feed`, `widgets`,
`screens`, `console`, `app`, `cli`. Imports lead down only. `docs/architecture.md` has the picture, `docs/glossary.md`
the words. Not here: simulated vehicles, which are the package `sitl` and know nothing of this one.
"""

__version__ = "0.2.0"
