"""gough view: a machine in the browser."""

from __future__ import annotations

import getpass
import socket
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

if TYPE_CHECKING:
    from gough.platform import Platform
    from gough.view.trajectory import Trajectory
    from gough.view.viewer import Viewer

ROWS = 2000


def run(
    file: Annotated[Positional[str | None], arg(metavar="[FILE]", help_behavior_hint="")] = None,
    *,
    platform: Annotated[
        str,
        arg(aliases=["-p"], metavar="PLATFORM", help="a machine of the catalog, or a .toml file."),
    ],
    html: Annotated[str | None, arg(metavar="OUT", help_behavior_hint="")] = None,
    host: Annotated[str, arg(metavar="HOST")] = "localhost",
    port: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None,
    open_browser: Annotated[bool, arg(name="open", help_behavior_hint="")] = False,
    rows: Annotated[int, arg(metavar="N")] = ROWS,
    time: Annotated[str | None, arg(metavar="COLUMN", help_behavior_hint="")] = None,
    keep_bad_rows: Annotated[bool, arg(help_behavior_hint="")] = False,
    ignore_platform: Annotated[bool, arg(help_behavior_hint="")] = False,
) -> int:
    """Show a machine in the browser, and move it by legs, by pose or by hand.

    gough view -p reachy_mini

    gough view poses.parquet -p rubin_camera

    gough view -p reference --html reference.html

    Serves the page until Ctrl-C.

    Exit code of --html: 0: written; 1: written, but a row shown has no pose.

    Args:
        file: play a .csv or .parquet file of poses or leg readings.
        html: write a page that opens without gough and without a network, and end.
        host: name or address to listen at; 0.0.0.0 opens the page to the whole network.
        port: port to listen at; without it the first free one from 8080.
        open_browser: open the page in this computer's browser.
        rows: largest number of rows shown, evenly spread over the file.
        time: column of times [s]; without it 30 rows are played per second.
        keep_bad_rows: show rows with text in a number column as rows without a pose.
        ignore_platform: read a file that was written for another platform.
    """
    from gough.platform import Platform

    machine = Platform.load(platform)
    if html is not None:
        from gough.whole_file import check_target

        check_target(html)
    rows_of_file = None
    if file is not None:
        from gough.commands.options import reading_options
        from gough.view.trajectory import read

        reading = reading_options(platform, "", keep_bad_rows, ignore_platform)
        rows_of_file = read(file, machine, rows=rows, time=time, reading=reading)
        print(rows_of_file.about, flush=True)
    if html is not None:
        return _write(html, machine, rows_of_file)
    return _serve(machine, rows_of_file, host, port, open_browser)


def _write(path: str, platform: Platform, trajectory: Trajectory | None) -> int:
    from gough.view.export import page
    from gough.view.model import Model
    from gough.whole_file import write_whole

    write_whole(path, page(Model(platform), trajectory).encode())
    print(f"{path}: {Path(path).stat().st_size / 1e6:.1f} MB; opens in any browser, offline")
    return 1 if trajectory is not None and trajectory.failures else 0


def _serve(
    platform: Platform, trajectory: Trajectory | None, host: str, port: int | None, browser: bool
) -> int:
    from gough.view.viewer import Viewer

    viewer = Viewer(platform, host=host, port=port, trajectory=trajectory)
    try:
        _announce(viewer, host, port, browser)
        viewer.wait()
    finally:
        viewer.close()
    return 0


def _announce(viewer: Viewer, host: str, port: int | None, browser: bool) -> None:
    """Print the address of the page, and the way to it from another computer."""
    from gough.view.scene import FIRST_PORT

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
