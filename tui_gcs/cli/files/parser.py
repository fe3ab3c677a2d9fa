"""The arguments of `tui-gcs convert`, `check` and `scenario`. It imports nothing heavy."""

import argparse

from tui_gcs.cli import options
from tui_gcs.cli.files.check_lines import PREVIEW_S
from tui_gcs.cli.options import Commands

CONVERT = """formats, by the ending of OUT (IN is looked into):
  .plan                    QGroundControl: mission, fence and rally points; what is unknown here is kept
  .waypoints .wpl .txt     QGC WPL 110: one of mission, fence, rally points
  .json                    ours: one of them; the missions screen's own file holds several vehicles (only as IN)
  .fen .fence .ral .rally  the older lists of Mission Planner and MAVProxy
  .kml .kmz .geojson       zones and paths
  .param .parm .params     parameters of Mission Planner, MAVProxy, QGroundControl
  .toml                    a scenario: zones of a drawing are added to --base

examples:
  tui-gcs convert field.plan field.waypoints
  tui-gcs convert swarm.toml zones.kml
  tui-gcs convert zones.kml new.toml --base swarm.toml --round 2 --role no-fly
  tui-gcs convert path.kml mission.plan --height 40
  tui-gcs convert missions.json field.plan            field-1.plan, field-2.plan ...; --vehicle 2: field.plan of it
  tui-gcs convert swarm.toml fence.plan --round "round 1"     its operating area and no-fly zones

Exit code 0 if OUT holds all of IN, 1 if it is written and something is left out, 2 if nothing is written."""

EXPORT = """examples:
  tui-gcs export flight.tlog > flight.csv                  a row for each position of each vehicle
  tui-gcs export flight.tlog --vehicles 1-4 --file flight.kml
  tui-gcs export flight.tlog 00000042.BIN --file both.csv  the vehicle's own log beside the station's, joined by time

Exit code 0, or 1 if a log is damaged, empty or without absolute times; 2 if nothing is written."""

PLOT = """examples:
  tui-gcs plot flight.tlog                                  then / finds values
  tui-gcs plot flight.tlog --show "v1-4 altitude" --show "battery voltage"
  tui-gcs plot flight.tlog 00000042.BIN --show BAT.Volt     the vehicle's own log beside the station's, joined by time
  tui-gcs plot flight.tlog --show ATTITUDE.roll --text | less"""

CHECK = "Exit code 0 if there is no error (cautions are none), 1 if there is one, 2 if the file cannot be read."


def add(commands: Commands) -> None:
    """Add the commands to the parser."""
    _add_scenario(commands)
    _add_convert(commands)
    _add_export(commands)
    _add_plot(commands)
    text = "what is wrong with a scenario, a plan or another file, before it flies"
    check = commands.add_parser("check", help=text, description=text, epilog=CHECK)
    check.set_defaults(module="files.check")
    check.add_argument("file", metavar="FILE")
    check.add_argument(
        "--autopilot",
        choices=("ardupilot", "px4"),
        help="the autopilot that is to fly it (default: as in a .plan; --preview: ardupilot)",
    )
    _common(check)
    check.add_argument("--scenario", metavar="SCENARIO.toml", help="judge a plan by its operating area, too")
    check.add_argument("--round", metavar="N|NAME", help="of the scenario (default: the first)")
    check.add_argument("--home", metavar="LAT,LON", help="where it starts, if the file does not say it")
    known = "heights of the ground: an SRTM tile (.hgt), a folder of them, or an .asc grid (also: TUI_GCS_TERRAIN)"
    check.add_argument("--terrain", metavar="PATH", help=known)
    known = "of a scenario: a planner in a file, so that gates of its metrics are checked; may be repeated"
    options.repeated(check, "--planner", "FILE.py", known)
    known = "of a scenario: what its planners would make of each round, and where teams meet"
    check.add_argument("--preview", action="store_true", help=known)
    known = f"of --preview: processor time for all teams (default: {PREVIEW_S:g}); with more, searches go on for longer"
    check.add_argument("--seconds", type=options.positive, metavar="S", help=known)
    options.report(check)


def _add_scenario(commands: Commands) -> None:
    text = "a small scenario to begin with; the rest is done by keys on the plan screen"
    scenario = options.command(commands, "scenario", text)
    scenario.set_defaults(module="scenario_new")
    actions = scenario.add_subparsers(title="actions", required=True, metavar="ACTION", dest="what")
    new = actions.add_parser("new", help="write FILE.toml; one that exists is not touched", description=text)
    new.add_argument("file", metavar="FILE.toml")
    known = "degrees, and metres of the ground above sea level (default: the demo's); south: --origin=-33.86,151.2,5"
    new.add_argument("--origin", metavar="LAT,LON[,AMSL]", help=known)
    new.add_argument("--vehicles", type=int, default=4, metavar="N", help="with system ids from 1 on (default 4)")
    new.add_argument("--teams", type=int, metavar="N", help="each with a zone of its own (default: one for 9 vehicles)")
    new.add_argument("--rounds", type=int, default=1, metavar="N", help="1 to 3 (default 1)")
    options.report(new)


def _add_convert(commands: Commands) -> None:
    text = "a file of another ground station or map program into another format"
    convert = options.command(commands, "convert", text, examples=CONVERT)
    convert.set_defaults(module="files.convert")
    convert.add_argument("source", metavar="IN")
    convert.add_argument("target", metavar="OUT")
    convert.add_argument("--force", action="store_true", help="overwrite OUT")
    names = ("plan", "wpl", "json", "fence", "rally", "kml", "kmz", "geojson", "param", "parm", "params", "scenario")
    convert.add_argument("--to", choices=names, metavar="FORMAT", help=f"whatever OUT ends in: {', '.join(names)}")
    _common(convert)
    convert.add_argument("--height", type=float, metavar="M", help="above home, for paths that do not say how high")
    convert.add_argument("--round", metavar="N|NAME", help="of a scenario (default: all, or the first)")
    convert.add_argument("--role", choices=("defend", "attack", "no-fly"), help="of zones that do not say it")
    known = "of a missions file (default: a file for each, OUT-1.plan, OUT-2.plan ...)"
    convert.add_argument("--vehicle", type=int, metavar="ID", help=known)
    convert.add_argument("--base", metavar="SCENARIO.toml", help="the scenario that zones are added to")
    options.report(convert)


def _add_export(commands: Commands) -> None:
    text = "the flown tracks of recorded flights, as a table or for map programs"
    export = options.command(commands, "export", text, examples=EXPORT)
    export.set_defaults(module="files.export")
    known = "a log of a station (.tlog), of an ArduPilot (.bin) or of a PX4 (.ulg)"
    export.add_argument("flight", metavar="FLIGHT", nargs="+", help=known)
    known = "default: as FILE ends; csv on the standard output"
    export.add_argument("--to", choices=("csv", "kml", "gpx"), help=known)
    export.add_argument("--vehicles", metavar="IDS", help="only these, as 3, 3-7 or 1,4")
    export.add_argument("--file", metavar="FILE", help="write a file instead of the standard output")
    export.add_argument("--force", action="store_true", help="overwrite FILE")
    options.report(export)


def _add_plot(commands: Commands) -> None:
    text = "values of recorded flights over time: on a screen, or as text where there is no terminal"
    plot = options.command(commands, "plot", text, examples=PLOT)
    plot.set_defaults(module="files.plot")
    known = "a log of a station (.tlog), of an ArduPilot (.bin) or of a PX4 (.ulg); several are joined by time"
    plot.add_argument("flight", metavar="FLIGHT", nargs="+", help=known)
    known = "a value by words of its name, unit or meaning, with v3 or v1-4 for these vehicles; may be repeated"
    options.repeated(plot, "--show", "WORDS", known)
    known = "the cursor stands at this time: 95 (seconds since the beginning), 1:35, or 12:41:07Z (of the day, UTC)"
    plot.add_argument("--at", metavar="TIME", help=known)
    plot.add_argument("--list", action="store_true", help="all values that the flights have, instead of a plot")
    plot.add_argument("--text", action="store_true", help="print the plot once, also on a terminal")
    options.report(plot)


def _common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--kind", choices=("mission", "fence", "rally"), help="which of them, where a file holds one")
    home = (
        "whether the first line of a WPL file is home (auto: a way-point with index 0 is; for a PX4 only an AMSL one)"
    )
    parser.add_argument("--home-line", choices=("auto", "yes", "no"), default="auto", help=home)
