"""Hosts that are none: network namespaces of this machine, joined by links as bad as asked.

Each host has its own address, its own loop-back and nothing else. What a host sends is delayed,
jittered and lost by ``tc netem`` on its end of the link, so that a message between two hosts
passes one such queue. The bridge lives in a namespace too: nothing of this machine changes.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from deploy.host_file import Link

_PREFIX = 24  # bits of the network that all hosts share
_QUEUE = 10_000  # packets; netem's own 1000 would lose more than asked


class NotPermitted(RuntimeError):
    """This machine does not let us make network namespaces; the text says what would help."""


class Network:
    """Namespaces that exist. Made by ``network``."""

    def __init__(self, hosts: Mapping[str, str], link: Link) -> None:
        self.hosts = dict(hosts)
        self.link = link
        self._tag = f"sh{os.getpid()}"

    def namespace(self, host: str) -> str:
        """Name of a host's namespace."""
        return f"{self._tag}-{host}"

    def command(self, host: str, *argv: str) -> list[str]:
        """A command line that runs another one on a host."""
        return ["ip", "netns", "exec", self.namespace(host), *argv]

    def cut(self, host: str) -> None:
        """Take a host off the network: what it sends and what is sent to it is lost."""
        _run("ip", "-n", self._hub, "link", "set", self._port(host), "down")

    def join(self, host: str) -> None:
        """Put it back."""
        _run("ip", "-n", self._hub, "link", "set", self._port(host), "up")

    @property
    def _hub(self) -> str:
        return f"{self._tag}-hub"

    def _port(self, host: str) -> str:
        return f"to{host}"

    def _make(self) -> None:
        hub = self._hub
        try:
            _run("ip", "netns", "add", hub)
        except subprocess.CalledProcessError as error:
            raise NotPermitted(
                f"no network namespaces here ({error.stderr.strip()}): be root on Linux; in a "
                "container --cap-add SYS_ADMIN --cap-add NET_ADMIN"
            ) from None
        _run("ip", "-n", hub, "link", "add", "br", "type", "bridge", "forward_delay", "0")
        _run("ip", "-n", hub, "link", "set", "br", "up")
        for host, address in self.hosts.items():
            ns, port = self.namespace(host), self._port(host)
            _run("ip", "netns", "add", ns)
            _run(*f"ip -n {hub} link add {port} type veth peer name eth0 netns {ns}".split())
            _run(*f"ip -n {hub} link set {port} master br up".split())
            _run("ip", "-n", ns, "address", "add", f"{address}/{_PREFIX}", "dev", "eth0")
            _run("ip", "-n", ns, "link", "set", "lo", "up")
            _run("ip", "-n", ns, "link", "set", "eth0", "up")
            self._worsen(ns)

    def _worsen(self, namespace: str) -> None:
        link = self.link
        if not (link.delay or link.jitter or link.loss):
            return
        netem = f"limit {_QUEUE} delay {link.delay * 1e3}ms {link.jitter * 1e3}ms"
        netem += f" loss {link.loss * 100}%"
        try:
            _run(*f"tc -n {namespace} qdisc add dev eth0 root netem {netem}".split())
        except subprocess.CalledProcessError as error:
            raise NotPermitted(f"this kernel has no netem ({error.stderr.strip()})") from None

    def _remove(self) -> None:
        for name in (*map(self.namespace, self.hosts), self._hub):
            subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)


@contextmanager
def network(hosts: Mapping[str, str], link: Link) -> Iterator[Network]:
    """Hosts on a network of their own, gone afterwards whatever happens.

    Args:
        hosts: name to IPv4 address, all in one network of 24 bits.
        link: what happens to everything a host sends.

    Raises:
        NotPermitted: this machine does not allow it.
    """
    for tool in ("ip", "tc"):
        if shutil.which(tool) is None:
            raise NotPermitted(f"no {tool!r} here: apt-get install iproute2")
    made = Network(hosts, link)
    try:
        made._make()
        yield made
    finally:
        made._remove()


def _run(*argv: str) -> None:
    subprocess.run(argv, check=True, capture_output=True, text=True)
