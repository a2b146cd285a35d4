"""gough view: a machine in the browser."""

from __future__ import annotations

import getpass
import socket
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from gough.commands.given import Legs, PoseNumbers
from gough.commands.options import FileOptions, Frame, PlatformName, ReadingOptions, option

if TYPE_CHECKING:
    from gough.platform import Platform
    from gough.pose import Pose
    from gough.view.trajectory import Trajectory
    from gough.view.viewer import Viewer

ROWS = 2000


def run(
    legs: Legs = (),
    *,
    platform: PlatformName,
    pose: PoseNumbers = None,
    frame: Frame = None,
    html: Annotated[str | None, option(metavar="OUT")] = None,
    host: Annotated[str, arg(metavar="HOST")] = "localhost",
    port: Annotated[int | None, option(metavar="N")] = None,
    open_browser: Annotated[bool, option(name="open")] = False,
    rows: Annotated[int, arg(metavar="N")] = ROWS,
    time: Annotated[str | None, option(metavar="COLUMN")] = None,
    reading: FileOptions = ReadingOptions(),
) -> int:
    """Show a machine in the browser, and move it by legs, by pose or by hand.

    gough view -p reachy_mini

    gough view 652.1 660.3 655.0 648.8 671.2 639.9 -p reference

    gough view poses.parquet -p rubin_camera

    gough view -p reference --html reference.html

    Serves the page until Ctrl-C.

    Exit code of --html: 0: written; 1: written, but a row shown has no pose.

    Args:
        legs: Begin with the pose of these six readings, or play this file of poses or readings;
            without it begin at home.
        html: Write a page that opens without gough and without a network, and end.
        host: Listen at this name or address; 0.0.0.0 opens the page to the whole network.
        port: Listen at this port; without it at the first free one from 8080.
        open_browser: Open the page in this computer's browser.
        rows: Show at most this many rows, evenly spread over the file.
        time: Play by this column of times [s]; without it 30 rows per second.
    """
    from gough.commands.given import legs_given, row_given
    from gough.platform import Platform

    machine = Platform.load(platform)
    if html is not None:
        from gough.whole_file import check_target

        check_target(html)
    options = reading.of(platform)
    played, start = None, None
    if pose is None and isinstance(path := legs_given(legs) if legs else None, str):
        from gough.view.trajectory import read

        played = read(path, machine, rows=rows, time=time, reading=options, frame=frame)
        frame = played.frame
        print(played.about, flush=True)
    elif given := row_given(legs, pose, machine, reading=options, frame=frame):
        start = given.pose[0]
    if html is not None:
        return _write(html, machine, played, start, frame)
    from gough.view.viewer import Viewer

    viewer = Viewer(machine, host=host, port=port, trajectory=played, start=start, frame=frame)
    return _serve(viewer, host, port, open_browser)


def _write(
    path: str,
    platform: Platform,
    trajectory: Trajectory | None,
    start: Pose | None,
    frame: str | None,
) -> int:
    from gough.view.export import page
    from gough.view.model import Model
    from gough.whole_file import write_whole

    write_whole(path, page(Model(platform, start, frame), trajectory).encode())
    print(f"{path}: {Path(path).stat().st_size / 1e6:.1f} MB; opens in any browser, offline")
    return 1 if trajectory is not None and trajectory.failures else 0


def _serve(viewer: Viewer, host: str, port: int | None, browser: bool) -> int:
    try:
        _announce(viewer, host, port, browser)
        viewer.wait()
    finally:
        viewer.close()
    return 0


def _announce(viewer: Viewer, host: str, port: int | None, browser: bool) -> None:
    """Print the address of the page, and the way to it from another computer."""
    from gough.view.server import FIRST_PORT

    if port is None and viewer.port != FIRST_PORT:
        print(f"port {FIRST_PORT} is taken; this is at {viewer.port}")
    shown = socket.gethostname() if host in ("0.0.0.0", "::") else host
    url = f"http://{shown}:{viewer.port}"
    print(f"{viewer.platform.name} is at {url} (Ctrl-C ends it)")
    if host in ("localhost", "127.0.0.1"):
        there = f"{getpass.getuser()}@{socket.gethostname()}"
        print(f"from another computer: ssh -N -L {viewer.port}:localhost:{viewer.port} {there}")
        print("and open the same address there")
    sys.stdout.flush()
    if browser:
        import webbrowser

        if not webbrowser.open(url):
            print("no browser was found here: open the address yourself", flush=True)
