"""Where services meet when they are spread over hosts: unix sockets within, TLS between.

With ``datagrams`` in the hosts file two services have a second link: where only the newest value
counts, it goes by QUIC datagrams. A lost packet then costs one value, while on TCP it holds up all
that come after it, for 20 ms and more on a link of 5 ms.
"""

from __future__ import annotations

from pathlib import Path

from deploy.host_file import KNOWN, Hosts
from services.wire.access import OPERATOR, PEOPLE
from services.wire.endpoints import Endpoints, Identity, local
from services.wire.keys import PEOPLE_FOLDER


def endpoints_of(hosts: Hosts, host: str, keys: Path, run_dir: Path, service: str) -> Endpoints:
    """What a service listens on and connects to.

    Of two services on different hosts, the later in starting order connects; those of its own host
    it meets on unix sockets.

    Args:
        hosts: the hosts file.
        host: where the service runs.
        keys: folder of this host's certificates.
        run_dir: of this host's sockets.
        service: its name.
    """
    here = local(run_dir, service)
    earlier = [
        name for name in KNOWN[: KNOWN.index(service)] if hosts.place(name) not in (None, host)
    ]
    return Endpoints(
        (*here.listen, *hosts.locators(service)),
        (*here.connect, *(locator for name in earlier for locator in hosts.locators(name))),
        Identity(hosts.robot, service, keys),
    )


def endpoints_for_people(hosts: Hosts, keys: Path) -> Endpoints:
    """Connect to every service of every host as a person: operator if we may, else watcher.

    Args:
        hosts: the hosts file.
        keys: what ``steadyhand keys`` made, or its folder ``people``.
    """
    folder = keys / PEOPLE_FOLDER if (keys / PEOPLE_FOLDER).is_dir() else keys
    role = next((role for role in PEOPLE if (folder / f"{role}.key").exists()), OPERATOR)
    everybody = [name for about in hosts.host.values() for name in about.services]
    locators = tuple(hosts.locators(name)[0] for name in everybody)
    return Endpoints((), locators, Identity(hosts.robot, role, folder))
