"""A viser server that says nothing of its own and is where it was asked to be."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager

import rich
import viser

from gough.errors import GoughError

FIRST_PORT = 8080  # unless another is asked for
PORTS_TRIED = 100


def start(host: str, port: int | None, label: str) -> viser.ViserServer:
    """A running server.

    Args:
        host: name or address to listen at; "localhost" is 127.0.0.1.
        port: the port to listen at, 0 for any, None for the first free one from 8080.

    Raises:
        GoughError: the port is taken, or the host is not this machine's.
    """
    address = "127.0.0.1" if host == "localhost" else host
    if port is None:
        tried = range(FIRST_PORT, FIRST_PORT + PORTS_TRIED)
        port = next((p for p in tried if _trouble(address, p) is None), FIRST_PORT)
    # viser itself would go on to other ports, or wait for ever
    trouble = _trouble(address, port)
    if trouble:
        raise GoughError(trouble)
    with _quiet():
        server = viser.ViserServer(address, port, verbose=False)
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    server.gui.set_panel_label(label)
    return server


def stop(server: viser.ViserServer) -> None:
    """End a server and its threads."""
    with _quiet():
        server.stop()


def _trouble(address: str, port: int) -> str | None:
    """Why one cannot listen there; None if one can."""
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
    return None


@contextmanager
def _quiet() -> Iterator[None]:
    """Viser prints a banner, and a line at its end, on the console that rich shares."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
