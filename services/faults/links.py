"""What a network between hosts does to a run in lockstep, as faults of messages."""

from __future__ import annotations

from collections.abc import Iterator

from deploy.host_file import Hosts
from services.faults import kinds as k
from services.topics import SERVICES, TOPICS


def crossing(hosts: Hosts) -> Iterator[tuple[str, str, str]]:
    """Topic, owner and reader of all that goes from one host to another."""
    for topic in TOPICS.values():
        if topic.owner not in SERVICES or topic.name.endswith("/tick"):
            continue
        for reader in topic.readers:
            if hosts.place(topic.owner) != hosts.place(reader):
                yield topic.name, topic.owner, reader


def bad_links(hosts: Hosts, duration: float) -> list[k.Fault]:
    """The delay, jitter and loss of a hosts file's link on every way between hosts.

    Each message has a fate of its own, as with ``datagrams``: nothing waits for what was lost.

    Args:
        hosts: who is where, and the link.
        duration: of the run [s].
    """
    link, out = hosts.link, list[k.Fault]()
    for topic, _, reader in crossing(hosts):
        least = link.delay - link.jitter
        out.append(k.Lateness(0.0, duration, topic, least, reader=reader))
        out.append(k.Reordering(0.0, duration, topic, 2 * link.jitter, reader=reader))
        out.append(k.Loss(0.0, duration, topic, link.loss, reader=reader))
    return out


def partition(hosts: Hosts, host: str, t: float, duration: float) -> list[k.Fault]:
    """A host is off the network from ``t`` [s] for ``duration`` [s]: nothing gets in or out."""
    return [
        k.Loss(t, duration, topic, 1.0, reader=reader)
        for topic, owner, reader in crossing(hosts)
        if host in (hosts.place(owner), hosts.place(reader))
    ]
