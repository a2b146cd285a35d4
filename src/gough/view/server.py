"""The server of one page: its port, and its quiet start and end."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from gough.errors import GoughError

if TYPE_CHECKING:
    import viser

FIRST_PORT = 8080  # without a port on the command line
PORTS_TRIED = 100


def open_server(host: str, port: int | None, label: str) -> viser.ViserServer:
    """Start a server for one page.

    Args:
        host: name or address to listen at; "localhost" is 127.0.0.1.
        port: the port to listen at, 0 for any, None for the first free one from 8080.
        label: heading of the panel.

    Raises:
        GoughError: the port is taken, or the host is not this machine's.
    """
    import viser

    address = "127.0.0.1" if host == "localhost" else host
    if port is None:
        tried = range(FIRST_PORT, FIRST_PORT + PORTS_TRIED)
        port = next((p for p in tried if not _port_problem(address, p)), FIRST_PORT)
    # viser itself would go on to other ports, or wait for ever
    problem = _port_problem(address, port)
    if problem:
        raise GoughError(problem)
    with _silent():
        server = viser.ViserServer(address, port, verbose=False)
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    server.gui.set_panel_label(label)
    return server


def close_server(server: viser.ViserServer) -> None:
    """End a server and its threads."""
    with _silent():
        server.stop()


def _port_problem(address: str, port: int) -> str:
    """Reason why nothing can listen there; empty if it can."""
    if not 0 <= port < 65536:
        return f"--port {port}: expected a number from 0 to 65535"
    try:
        family = socket.getaddrinfo(address, port, type=socket.SOCK_STREAM)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((address, port))
    except socket.gaierror as error:
        return f"--host {address}: {error.strerror}; expected a name or address of this machine"
    except OSError as error:
        return f"--port {port}: {error.strerror} at {address}; pass another --port or --host"
    return ""


@contextmanager
def _silent() -> Iterator[None]:
    """Keep viser from printing a banner, and a line at its end, on the console of rich."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
