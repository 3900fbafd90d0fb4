"""Where the processes meet: fixed endpoints, never discovery.

Each service listens on a socket of its own in the run directory and connects to those of all
others, again and again until they answer. There is no hub: any process, the first one included,
may be killed and come back without the others doing anything.
"""

from __future__ import annotations

import ipaddress
import json
import os
import stat
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zenoh

from services.topics import CONSOLE, PROCESSES
from services.wire.access import access_control

_BATCHES = 16  # that may wait to be sent to one reader, at each priority; more is not allowed
LEASE = 1000  # [ms]; a stopped process is noticed after this, a killed one at once
_LONGEST_SOCKET = 100  # [bytes]; the kernel allows 107, zenoh appends ".lock" to the name
LARGEST = 1 << 16  # [bytes]; our messages are below 2 kB, and longer ones never reach Python
_LARGEST_FRAGMENTED = 1 << 20  # [bytes] that somebody may have us put together; Zenoh's is 1 GiB
_SESSIONS = 64  # at a time
_OPEN = 1000  # [ms] for a handshake
SECURE = ("tls", "quic", "unixsock-stream")


class BadEndpoint(ValueError):
    """An endpoint that must not be used; the text says why and what to do."""


@dataclass(frozen=True)
class Identity:
    """Who a process is to those on other hosts.

    Attributes:
        robot: name of the robot.
        role: one of ``access.ROLES``; its certificate says the same.
        folder: holds ``authority.pem``, ``<role>.pem`` and ``<role>.key``.
    """

    robot: str
    role: str
    folder: Path

    def files(self) -> tuple[Path, Path, Path]:
        """Certificate of the authority, our certificate, our key.

        Raises:
            BadEndpoint: one is missing, or others may read the key.
        """
        files = tuple(
            self.folder / n for n in ("authority.pem", f"{self.role}.pem", f"{self.role}.key")
        )
        for file in files:
            if not file.is_file():
                raise BadEndpoint(f"{file} is missing. Make keys: steadyhand keys HOSTS -o FOLDER")
        if files[2].stat().st_mode & 0o077:
            raise BadEndpoint(f"others may read {files[2]}: chmod 600 {files[2]}")
        return files  # type: ignore[return-value]


@dataclass(frozen=True)
class Endpoints:
    """Zenoh locators to listen on and to connect to; with an identity, the secure profile."""

    listen: tuple[str, ...]
    connect: tuple[str, ...]
    identity: Identity | None = None


def default_run_dir(robot: str) -> Path:
    """Directory of a robot's sockets, lock and logs on this machine, per user."""
    base = os.environ.get("XDG_RUNTIME_DIR") or f"{tempfile.gettempdir()}/steadyhand-{os.getuid()}"
    return Path(base) / "steadyhand" / robot


def make_run_dir(run_dir: Path) -> Path:
    """Create the run directory, closed to other users: whoever may write may move the arm.

    Raises:
        BadEndpoint: its name is too long for a unix socket, or others may write in it, or put
            another in its place.
    """
    if len(str(run_dir / "supervisor.sock")) > _LONGEST_SOCKET:
        raise BadEndpoint(f"{run_dir} is too long a name for unix sockets; use a shorter --run-dir")
    run_dir.mkdir(parents=True, exist_ok=True, mode=0o700)
    about = run_dir.stat()
    unsafe = [run_dir] if about.st_uid != os.getuid() or about.st_mode & 0o022 else []
    unsafe += [folder for folder in run_dir.resolve().parents if _replaceable(folder)]
    if unsafe:
        raise BadEndpoint(
            f"{unsafe[0]} belongs to somebody else or others may write in it: whoever may write "
            "there may move the arm. Remove it, or give another --run-dir"
        )
    return run_dir


def _replaceable(folder: Path) -> bool:
    """Whether other users may put something else in the place of what is in a folder."""
    about = folder.stat()
    sticky = about.st_mode & stat.S_ISVTX
    return about.st_uid not in (0, os.getuid()) or bool(about.st_mode & 0o002 and not sticky)


def scenario_file(run_dir: Path) -> Path:
    """Where the supervisor writes which scenario runs, for whoever draws the robot."""
    return run_dir / "scenario"


def local(run_dir: Path, name: str | None = None) -> Endpoints:
    """Unix sockets in ``run_dir``; without a name it only connects (tools, consoles)."""
    listen = (f"unixsock-stream/{run_dir}/{name}.sock",) if name else ()
    others = [s for s in (*PROCESSES, "supervisor", CONSOLE) if s != name]
    return Endpoints(listen, tuple(f"unixsock-stream/{run_dir}/{s}.sock" for s in others))


def check_open(endpoints: tuple[str, ...]) -> None:
    """Refuse what other machines can reach: without certificates nothing tells them from us.

    Raises:
        BadEndpoint: naming the endpoint.
    """
    for endpoint in endpoints:
        protocol, _, address = endpoint.partition("/")
        if protocol == "unixsock-stream":
            continue
        host = address.split("#")[0].split("?")[0].rpartition(":")[0].strip("[]")
        try:
            loopback = host == "localhost" or ipaddress.ip_address(host).is_loopback
        except ValueError:
            loopback = False
        if protocol not in ("tcp", "tls") or not loopback:
            raise BadEndpoint(
                f"refusing to use {endpoint}: others on the network could move the robot. "
                "Use a unix socket or 127.0.0.1; beyond this machine mutual TLS and default-deny "
                "access control are needed: steadyhand keys, docs/hosts.md"
            )


def check_secure(endpoints: tuple[str, ...]) -> None:
    """Refuse what does not go through TLS (QUIC has it inside) or a unix socket.

    Raises:
        BadEndpoint: naming the endpoint.
    """
    for endpoint in endpoints:
        if endpoint.partition("/")[0] not in SECURE:
            raise BadEndpoint(f"refusing to use {endpoint}: with keys, only {', '.join(SECURE)}")


def config(endpoints: Endpoints) -> zenoh.Config:
    """Zenoh configuration: peer mode, no scouting, small messages, quick detection of silence.

    Raises:
        BadEndpoint: an endpoint beyond this machine without keys, or unusable keys.
    """
    secure = endpoints.identity is not None
    (check_secure if secure else check_open)((*endpoints.listen, *endpoints.connect))
    everything = {
        "messages": ["put", "delete", "query", "reply"],
        "flows": ["ingress", "egress"],
        "key_exprs": ["**"],
        "size_limit": LARGEST,
    }
    settings = {
        "mode": "peer",
        "listen/endpoints": list(endpoints.listen),
        "connect/endpoints": list(endpoints.connect),
        "connect/timeout_ms": -1,  # in the background, for ever; 0 would be one attempt
        "connect/exit_on_failure": False,
        "connect/retry": {
            "period_init_ms": 50,
            "period_max_ms": 200,
            "period_increase_factor": 1.5,
        },
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
        "transport/link/tx/lease": LEASE,
        # of two, the usual number, a sender runs out when its sending thread is not served for a
        # while, and then waits itself
        "transport/link/tx/queue/size/real_time": _BATCHES,
        "transport/link/tx/queue/size/data": _BATCHES,
        "transport/link/rx/max_message_size": _LARGEST_FRAGMENTED,
        "transport/unicast/max_sessions": _SESSIONS,
        "low_pass_filter": [everything],
        "queries_default_timeout": 5000,
    }
    if endpoints.identity is not None:
        settings |= _secure(endpoints.identity)
    out = zenoh.Config()
    for name, value in settings.items():
        out.insert_json5(name, json.dumps(value))
    return out


def _secure(identity: Identity) -> dict[str, Any]:
    """Mutual TLS, and access control that denies what it does not allow."""
    authority, certificate, key = (str(file) for file in identity.files())
    return {
        "transport/link/protocols": SECURE,
        # a host that is not there yet is silent on UDP: every endpoint may hold us up so long
        "transport/unicast/open_timeout": _OPEN,
        "transport/unicast/accept_timeout": _OPEN,
        "transport/unicast/max_links": 2,  # TLS, and QUIC datagrams beside it
        "transport/link/tls": {
            "root_ca_certificate": authority,
            "listen_certificate": certificate,
            "listen_private_key": key,
            "connect_certificate": certificate,
            "connect_private_key": key,
            "enable_mtls": True,
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
        },
        "access_control": access_control(identity.robot),
    }
