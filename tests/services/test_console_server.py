"""The page's server: this machine only, pages of its own only, no public tunnel."""

from __future__ import annotations

import queue
import socket
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
import viser
from patience import PATIENCE
from viser import _messages
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from services.console.server import HOST, PortInUse, Server


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    """On a port that is free."""
    server = Server(0, "test")
    yield server
    server.stop()


def browser(server: Server, origin: str | None) -> ClientConnection:
    """A WebSocket as viser's page opens it."""
    protocol = f"viser-v{viser.__version__}"
    return connect(
        server.url.replace("http", "ws"),
        origin=origin,  # type: ignore[arg-type]
        subprotocols=[protocol],  # type: ignore[list-item]
    )


def serves(server: Server) -> bool:
    """Whether the page itself can be had."""
    with urllib.request.urlopen(server.url, timeout=PATIENCE) as answer:
        return bool(b"<html" in answer.read().lower())


def test_it_listens_on_loopback_alone(server: Server) -> None:
    """Bound to 127.0.0.1, so that another address of this machine does not answer."""
    assert server.get_host() == HOST
    listening = [
        line.split()[1].split(":")
        for line in Path("/proc/net/tcp").read_text().splitlines()[1:]
        if line.split()[3] == "0A"
    ]
    mine = [address for address, port in listening if int(port, 16) == server.get_port()]
    assert mine == ["0100007F"]


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "http://127.0.0.1:1", "null", "https://localhost"]
)
def test_a_page_from_elsewhere_is_refused(server: Server, origin: str) -> None:
    """Its WebSocket does not come about: it cannot press anything."""
    with pytest.raises(InvalidStatus) as refused, browser(server, origin):
        pass
    assert refused.value.response.status_code == 403


def test_its_own_page_is_served(server: Server) -> None:
    """By either name of this machine."""
    assert serves(server)
    for name in (HOST, "localhost"):
        with browser(server, f"http://{name}:{server.get_port()}") as page:
            assert page.recv(timeout=PATIENCE)


def test_nobody_gets_a_public_tunnel(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither by calling for it nor as a browser does, with viser's own message."""
    asked: queue.Queue[str | None] = queue.Queue()
    refuse = server.request_share_url
    assert refuse() is None
    monkeypatch.setattr(server, "request_share_url", lambda: asked.put(refuse()))
    with browser(server, server.url) as page:
        page.send(msgspec.msgpack.encode({"type": _messages.ShareUrlRequest.__name__}))
        assert asked.get(timeout=PATIENCE) is None
    assert server._share_tunnel is None


@pytest.mark.parametrize("garbage", [b"", b"\xff" * 100, b"\x93\x01\x02\x03", "words"])
def test_a_browser_that_sends_garbage_ends_only_itself(
    server: Server, garbage: bytes | str
) -> None:
    """Others are served as before."""
    with browser(server, server.url) as good:
        with browser(server, server.url) as bad:
            bad.send(garbage)
        assert good.recv(timeout=PATIENCE)
    assert serves(server)


def test_a_port_in_use_is_said_with_what_to_do() -> None:
    """Not the next port in silence, as viser does."""
    with socket.socket() as taken:
        taken.bind((HOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(PortInUse, match=rf"port {port} .*not free.*--port \(0 for any"):
            Server(port, "test")
