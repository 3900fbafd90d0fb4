"""Robots with certificates on loop-back, and strangers who try to talk to them."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from services.bench.hostile import free_door, own_address
from services.topics import Topic
from services.wire.bus import Bus, open_bus
from services.wire.endpoints import Endpoints, Identity
from services.wire.keys import Authority, issue, new_authority


@dataclass
class Place:
    """Where processes with certificates meet."""

    folder: Path
    stack: ExitStack
    authority: Authority = field(default_factory=lambda: new_authority("r1"))
    doors: dict[str, str] = field(default_factory=dict)

    def identity(self, role: str, authority: Authority | None = None, days: float = 1) -> Identity:
        """A role's certificate, of our authority if no other is given."""
        folder = self.folder / f"{role}-{len(list(self.folder.glob('*')))}"
        issue(authority or self.authority, folder, "r1", role, own_address(), days)
        if authority is not None:  # the stranger trusts us: it is we who must not trust it
            (folder / "authority.pem").write_bytes(self.authority.pem())
        return Identity("r1", role, folder)

    def listening(self, role: str, *inputs: Topic) -> Bus:
        """A service that listens, and connects to nobody."""
        self.doors[role] = free_door()
        endpoints = Endpoints((f"tls/{self.doors[role]}",), (), self.identity(role))
        return self.stack.enter_context(open_bus(endpoints, "r1", role, inputs))

    def connecting(self, service: str, identity: Identity, to: str, *inputs: Topic) -> Bus:
        """A process that calls itself ``service`` and connects with a certificate."""
        endpoints = Endpoints((), (f"tls/{self.doors[to]}",), identity)
        return self.stack.enter_context(open_bus(endpoints, "r1", service, inputs))
