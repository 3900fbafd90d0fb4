"""Hosts that are none: network namespaces of this machine, joined by links as bad as asked.

Each host has its own address, its own loop-back and nothing else. What a host sends is delayed,
jittered and lost, so that a message between two hosts suffers once: by ``tc netem`` on its end of a
veth pair where the kernel has it, else in software (``bad_link.py``). The bridge between the pairs
lives in a namespace too: nothing of this machine changes.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from deploy.host_file import Link
from services.live.bad_link import Switch, open_tun

_PREFIX = 24  # bits of the network that all hosts share
_QUEUE = 10_000  # packets; netem's own 1000 would lose more than asked


class NotPermitted(RuntimeError):
    """This machine does not let us make network namespaces; the text says what would help."""


class Network:
    """Namespaces that exist. Made by ``network``."""

    def __init__(self, hosts: Mapping[str, str], link: Link) -> None:
        self.hosts = dict(hosts)
        self.link = link
        self.how = ""
        """What makes the links bad: netem, software, or nothing."""
        self._tag = f"sh{os.getpid()}"
        self._switch: Switch | None = None

    def namespace(self, host: str) -> str:
        """Name of a host's namespace."""
        return f"{self._tag}-{host}"

    def command(self, host: str, *argv: str) -> list[str]:
        """A command line that runs another one on a host."""
        return ["ip", "netns", "exec", self.namespace(host), *argv]

    def cut(self, host: str) -> None:
        """Take a host off the network: what it sends and what is sent to it is lost."""
        if self._switch is not None:
            self._switch.cut.add(self.hosts[host])
        else:
            _run(*f"ip -n {self._hub} link set to{host} down".split())

    def join(self, host: str) -> None:
        """Put it back."""
        if self._switch is not None:
            self._switch.cut.discard(self.hosts[host])
        else:
            _run(*f"ip -n {self._hub} link set to{host} up".split())

    @property
    def _hub(self) -> str:
        return f"{self._tag}-hub"

    def _make(self, seed: int) -> None:
        try:
            for name in (self._hub, *map(self.namespace, self.hosts)):
                _run("ip", "netns", "add", name)
        except subprocess.CalledProcessError as error:
            raise NotPermitted(
                f"no network namespaces here ({error.stderr.strip()}): be root on Linux; in a "
                "container --cap-add SYS_ADMIN --cap-add NET_ADMIN"
            ) from None
        perfect = self.link == Link()
        if perfect or self._has_netem():
            self.how = "nothing" if perfect else "netem"
            self._wire()
        else:
            self.how = "software"
            files = {a: open_tun(self.namespace(h), "eth0") for h, a in self.hosts.items()}
            self._switch = Switch(files, self.link, seed)
        for host, address in self.hosts.items():
            ns = self.namespace(host)
            _run(*f"ip -n {ns} address add {address}/{_PREFIX} dev eth0".split())
            _run(*f"ip -n {ns} link set lo up".split())
            _run(*f"ip -n {ns} link set eth0 up".split())
            if self.how == "netem":
                _run(*f"tc -n {ns} qdisc add dev eth0 root netem {self._netem()}".split())

    def _wire(self) -> None:
        hub = self._hub
        _run(*f"ip -n {hub} link add name bridge0 type bridge".split())
        _run(*f"ip -n {hub} link set bridge0 up".split())
        for host in self.hosts:
            pair = f"to{host} type veth peer name eth0 netns {self.namespace(host)}"
            _run(*f"ip -n {hub} link add name {pair}".split())
            _run(*f"ip -n {hub} link set to{host} master bridge0 up".split())

    def _has_netem(self) -> bool:
        probe = f"tc -n {self._hub} qdisc add dev lo root netem delay 1ms".split()
        return subprocess.run(probe, capture_output=True, check=False).returncode == 0

    def _netem(self) -> str:
        link = self.link
        waits = f"delay {link.delay * 1e3}ms {link.jitter * 1e3}ms" if link.delay else ""
        return f"limit {_QUEUE} {waits} loss {link.loss * 100}%"

    def _remove(self) -> None:
        if self._switch is not None:
            self._switch.close()
        for name in (*map(self.namespace, self.hosts), self._hub):
            subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)


@contextmanager
def network(hosts: Mapping[str, str], link: Link, seed: int = 0) -> Iterator[Network]:
    """Hosts on a network of their own, gone afterwards whatever happens.

    Args:
        hosts: name to IPv4 address, all in one network of 24 bits.
        link: what happens to everything a host sends.
        seed: of what is drawn, where it is done in software.

    Raises:
        NotPermitted: this machine does not allow it.
    """
    for tool in ("ip", "tc"):
        if shutil.which(tool) is None:
            raise NotPermitted(f"no {tool!r} here: apt-get install iproute2")
    made = Network(hosts, link)
    try:
        made._make(seed)
        yield made
    finally:
        made._remove()


def _run(*argv: str) -> None:
    subprocess.run(argv, check=True, capture_output=True, text=True)
