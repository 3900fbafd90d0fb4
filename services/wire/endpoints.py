"""Where the processes meet: fixed endpoints, never discovery.

Each service listens on a socket of its own in the run directory and connects to those of all
others, again and again until they answer. There is no hub: any process, the first one included,
may be killed and come back without the others doing anything.
"""

from __future__ import annotations

import ipaddress
import json
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import zenoh

from services.topics import CONSOLE, PROCESSES

LEASE = 1000  # [ms]; a stopped process is noticed after this, a killed one at once
_LONGEST_SOCKET = 100  # [bytes]; the kernel allows 107, zenoh appends ".lock" to the name


class BadEndpoint(ValueError):
    """An endpoint that must not be used; the text says why and what to do."""


@dataclass(frozen=True)
class Endpoints:
    """Zenoh locators to listen on and to connect to."""

    listen: tuple[str, ...]
    connect: tuple[str, ...]


def default_run_dir(robot: str) -> Path:
    """Directory of a robot's sockets, lock and logs on this machine, per user."""
    base = os.environ.get("XDG_RUNTIME_DIR") or f"{tempfile.gettempdir()}/steadyhand-{os.getuid()}"
    return Path(base) / "steadyhand" / robot


def make_run_dir(run_dir: Path) -> Path:
    """Create the run directory, closed to other users: whoever may write may move the arm.

    Raises:
        BadEndpoint: its name is too long for a unix socket.
    """
    if len(str(run_dir / "supervisor.sock")) > _LONGEST_SOCKET:
        raise BadEndpoint(f"{run_dir} is too long a name for unix sockets; use a shorter --run-dir")
    run_dir.mkdir(parents=True, exist_ok=True, mode=0o700)
    about = run_dir.stat()
    if about.st_uid != os.getuid() or about.st_mode & 0o022:
        raise BadEndpoint(
            f"{run_dir} belongs to somebody else or others may write in it: whoever may write "
            "there may move the arm. Remove it, or give another --run-dir"
        )
    return run_dir


def scenario_file(run_dir: Path) -> Path:
    """Where the supervisor writes which scenario runs, for whoever draws the robot."""
    return run_dir / "scenario"


def local(run_dir: Path, name: str | None = None) -> Endpoints:
    """Unix sockets in ``run_dir``; without a name it only connects (tools, consoles)."""
    listen = (f"unixsock-stream/{run_dir}/{name}.sock",) if name else ()
    others = [s for s in (*PROCESSES, "supervisor", CONSOLE) if s != name]
    return Endpoints(listen, tuple(f"unixsock-stream/{run_dir}/{s}.sock" for s in others))


def check_listen(listen: tuple[str, ...]) -> None:
    """Refuse a listener that other machines can reach.

    Raises:
        BadEndpoint: naming the endpoint.
    """
    for endpoint in listen:
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
                f"refusing to listen on {endpoint}: others on the network could move the robot. "
                "Use a unix socket or 127.0.0.1; beyond this machine mutual TLS and default-deny "
                "access control are needed"
            )


def config(endpoints: Endpoints) -> zenoh.Config:
    """Zenoh configuration: peer mode, no scouting, small messages, quick detection of silence."""
    check_listen(endpoints.listen)
    settings = {
        "mode": "peer",
        "listen/endpoints": list(endpoints.listen),
        "connect/endpoints": list(endpoints.connect),
        "connect/timeout_ms": 0,
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
        "queries_default_timeout": 5000,
    }
    out = zenoh.Config()
    for name, value in settings.items():
        out.insert_json5(name, json.dumps(value))
    return out
