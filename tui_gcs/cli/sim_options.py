"""What can be said of simulated vehicles and their world on a command line; imports nothing heavy."""

import argparse


def weather(parser: argparse.ArgumentParser) -> None:
    """Wind and doubtful positions."""
    parser.add_argument("--wind", metavar="E,N", help="m/s toward east and north, with gusts")
    parser.add_argument("--gps-noise", type=float, metavar="M", help="standard deviation of positions")


def world(parser: argparse.ArgumentParser) -> None:
    """Intruders, and what finds them."""
    parser.add_argument("--intruders", type=int, metavar="N", help="so many in each wave, against the defended zone")
    parser.add_argument(
        "--sensor",
        metavar="WHAT",
        help="what the vehicles see them with, e.g. range=60,rate=5,p=0.9,false=1,sigma=2 (m, Hz, share, 1/min, m)",
    )


def autopilot(parser: argparse.ArgumentParser) -> None:
    """Whose behaviour is simulated."""
    known = "of the simulated vehicles, default ardupilot; mixed: they take turns"
    parser.add_argument("--autopilot", choices=("ardupilot", "px4", "mixed"), help=known)


def fault(parser: argparse.ArgumentParser) -> None:
    """Bad links."""
    parser.add_argument(
        "--fault",
        default="",
        metavar="FAULTS",
        help="bad links, e.g. loss=0.1,burst=0.05/0.3,delay=200ms,jitter=20%%,dup=0.01,reorder=0.05,rate=5760,"
        "corrupt=1e-4,flap=10s/2s; up.NAME=… to the vehicles only, down.NAME=… to the station only",
    )
