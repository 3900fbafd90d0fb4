"""The hosts file: which computers there are, and which services run where."""

from __future__ import annotations

import ipaddress
import re
from pathlib import Path
from typing import Annotated

from pydantic import Field, field_validator, model_validator

from deploy.tomlfile import BadFile, Strict, load_toml

HOSTS = Path(__file__).parent / "hosts"
KNOWN = ("recorder", "sim", "observer", "arm", "base")
"""Services in starting order, as in ``services/topics.py``."""

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9]{0,7}$")]


class Host(Strict):
    """One computer."""

    address: str
    """IP address, or a name that every host resolves."""
    services: tuple[str, ...]

    @field_validator("address")
    @classmethod
    def _usable(cls, value: str) -> str:
        try:
            ipaddress.ip_address(value)
        except ValueError:
            if not re.fullmatch(r"[A-Za-z0-9]([A-Za-z0-9.-]{0,251}[A-Za-z0-9])?", value):
                raise ValueError("neither an IP address nor the name of a host") from None
        return value

    @field_validator("services")
    @classmethod
    def _known(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        unknown = [name for name in value if name not in KNOWN]
        if unknown or not value:
            raise ValueError(
                f"no service {', '.join(unknown) or 'named'}. Known: {', '.join(KNOWN)}"
            )
        return tuple(name for name in KNOWN if name in value)


class Link(Strict):
    """What the network between namespaces does to everything a host sends."""

    delay: Annotated[float, Field(ge=0, le=1)] = 0.0
    """One way [s]."""
    jitter: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Either way of ``delay`` [s]."""
    loss: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Share of packets."""


class Hosts(Strict):
    """The whole file."""

    robot: Name = "r1"
    """Part of every key and certificate."""
    scenario: str = "whiteboard_moving"
    port: Annotated[int, Field(ge=1024, le=65000)] = 7447
    """Of the first service; the others follow in the order of ``KNOWN``."""
    datagrams: bool = False
    """Send what only counts while it is new by QUIC datagrams (UDP), beside TLS."""
    host: Annotated[dict[Name, Host], Field(min_length=1)]
    link: Link = Link()

    @model_validator(mode="after")
    def _one_place_each(self) -> Hosts:
        everywhere = [name for host in self.host.values() for name in host.services]
        twice = sorted({name for name in everywhere if everywhere.count(name) > 1})
        if twice:
            raise ValueError(f"{', '.join(twice)} on more than one host")
        addresses = [host.address for host in self.host.values()]
        if len(set(addresses)) < len(addresses):
            raise ValueError("two hosts at one address")
        return self

    def place(self, service: str) -> str | None:
        """Name of the host a service runs on; None if on none."""
        return next((n for n, host in self.host.items() if service in host.services), None)

    def locators(self, service: str) -> tuple[str, ...]:
        """Where others reach a service: Zenoh's locators, that of TLS first.

        Raises:
            KeyError: it runs on no host.
        """
        address = self.host[self.place(service) or service].address
        bracketed = f"[{address}]" if ":" in address else address
        port = self.port + KNOWN.index(service)
        beside = (f"quic/{bracketed}:{port}?rel=0",) if self.datagrams else ()
        return (f"tls/{bracketed}:{port}", *beside)


def load_hosts(name: str | Path) -> Hosts:
    """Read a hosts file: a path, or the name of one in ``deploy/hosts``.

    Raises:
        BadFile: with every finding, or the names there are.
    """
    path = Path(name)
    if not path.suffix and not path.exists():
        path = HOSTS / f"{name}.toml"
        if not path.exists():
            known = ", ".join(sorted(file.stem for file in HOSTS.glob("*.toml")))
            raise BadFile(Path(name), [f"no such hosts file. Known: {known}, or give a path"])
    return load_toml(path, Hosts)
