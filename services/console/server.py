"""The web server: viser's, on this machine only, refusing foreign pages and public tunnels."""

from __future__ import annotations

import contextlib
import io
import socket
from collections.abc import Iterator
from typing import Any

import viser
from viser.infra import _infra

HOST = "127.0.0.1"
PORT = 8080


class PortInUse(RuntimeError):
    """Somebody else listens there; the text says what to do."""


class Server(viser.ViserServer):
    """A page for people on this machine; from another one through ``ssh -L``.

    Viser listens everywhere by default, takes the next port if one is taken, accepts any page's
    WebSocket, and opens a public tunnel for whichever browser asks for one. None of that here.

    Args:
        port: to listen on; 0 for any that is free.
        title: above the controls.

    Raises:
        PortInUse: ``port`` is taken.
    """

    def __init__(self, port: int, title: str) -> None:
        listener = _bound(port)
        number = listener.getsockname()[1]
        origins = [f"http://{name}:{number}" for name in (HOST, "localhost")]
        with _serving_on(listener, origins) as used, contextlib.redirect_stdout(io.StringIO()):
            super().__init__(host=HOST, port=number, label=title, verbose=False)
        if not used:  # its insides have changed: better no page than one for everybody
            self.stop()
            raise RuntimeError("this version of viser cannot be kept to this machine")
        self.url = f"http://{HOST}:{number}"
        self.gui.configure_theme(show_logo=False, show_share_button=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refused: whoever has the address of a tunnel may move the robot."""
        return None


def _bound(port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
    except OSError as error:
        listener.close()
        raise PortInUse(
            f"port {port} of {HOST} is not free ({error.strerror}). Perhaps another console: open "
            f"http://{HOST}:{port}, or give this one another --port (0 for any that is free)"
        ) from None
    return listener


@contextlib.contextmanager
def _serving_on(listener: socket.socket, origins: list[str]) -> Iterator[list[bool]]:
    """While inside, viser serves on this socket, to WebSockets from these pages.

    A browser states the page a WebSocket comes from and cannot be made to lie about it; who is no
    browser may state none.
    """
    serving: Any = _infra.websockets.asyncio.server
    original = serving.serve
    used: list[bool] = []

    def serve(handler: Any, host: str, port: int, **options: Any) -> Any:
        used.append(True)
        return original(handler, sock=listener, origins=[*origins, None], **options)

    serving.serve = serve
    try:
        yield used
    finally:
        serving.serve = original
