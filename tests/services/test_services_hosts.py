"""One file says which computers there are; it configures real ones and namespaces alike."""

from __future__ import annotations

import os
import re
import socket
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from cryptography import x509
from patience import PATIENCE

from deploy.host_file import HOSTS, KNOWN, Hosts, Link, load_hosts
from deploy.tomlfile import BadFile
from services.components import build_service
from services.live.namespaces import Network, NotPermitted, network
from services.live.notify import notify
from services.topics import PROCESSES, TOPICS
from services.wire.access import PEOPLE, ROLES, access_control, hears
from services.wire.endpoints import BadEndpoint, Identity, config
from services.wire.keys import make_keys
from services.wire.places import endpoints_for_people, endpoints_of
from sim.scenario import scenario_names

THREE = {
    "scenario": "whiteboard",
    "host": {
        "arm": {"address": "10.1.1.1", "services": ["arm", "sim"]},
        "far": {"address": "10.1.1.2", "services": ["base", "observer"]},
    },
}


def _keys(folder: Path, hosts: Hosts) -> Path:
    about = {name: (host.address, host.services) for name, host in hosts.host.items()}
    make_keys(folder, hosts.robot, about)
    return folder


@pytest.mark.parametrize("name", sorted(file.stem for file in HOSTS.glob("*.toml")))
def test_every_hosts_file_places_a_whole_robot(name: str) -> None:
    """Each service of the robot is on one host."""
    hosts = load_hosts(name)
    assert all(hosts.place(service) for service in PROCESSES)


def test_services_are_those_of_the_topic_table() -> None:
    """The file may name what can run, and nothing else."""
    assert KNOWN == PROCESSES


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ('services = ["arm", "moon"]', "moon"),
        ('services = ["base"]', "more than one host"),
        ('services = []', "Known"),
        ('address = "10.1.1.2"', "one address"),
        ('address = "a b"', "neither"),
        ('port = "x"', "unknown key"),
    ],
)  # fmt: skip
def test_a_wrong_hosts_file_is_refused(tmp_path: Path, change: str, said: str) -> None:
    """With the place and what is allowed."""
    entries = {"address": 'address = "10.1.1.1"', "services": 'services = ["arm", "sim"]'}
    entries[change.split()[0]] = change
    far = '[host.far]\naddress = "10.1.1.2"\nservices = ["base", "observer"]\n'
    file = tmp_path / "hosts.toml"
    file.write_text("[host.arm]\n" + "\n".join(entries.values()) + "\n" + far)
    with pytest.raises(BadFile, match=said):
        load_hosts(file)


def test_between_two_hosts_only_one_side_connects(tmp_path: Path) -> None:
    """The later in starting order does; within a host it is unix sockets."""
    hosts = Hosts.model_validate(THREE)
    ends = {s: endpoints_of(hosts, hosts.place(s) or "", tmp_path, tmp_path, s) for s in KNOWN[1:]}
    for a, ours in ends.items():
        for b, theirs in ends.items():
            if hosts.place(a) == hosts.place(b):
                assert not set(ours.connect) & set(hosts.locators(b))
            elif KNOWN.index(a) < KNOWN.index(b):
                assert set(hosts.locators(a)) <= set(theirs.connect)
                assert not set(hosts.locators(b)) & set(ours.connect)


def test_keys_are_ours_alone(tmp_path: Path) -> None:
    """A host gets no key but its services', and keys that others may read are not used."""
    hosts = Hosts.model_validate(THREE)
    keys = _keys(tmp_path / "keys", hosts)
    assert {f.name for f in (keys / "far").iterdir()} == {
        "authority.pem", "base.pem", "base.key", "observer.pem", "observer.key",
    }  # fmt: skip
    for file in keys.rglob("*.key"):
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
    config(endpoints_of(hosts, "far", keys / "far", tmp_path, "base"))
    (keys / "far" / "base.key").chmod(0o644)
    with pytest.raises(BadEndpoint, match="chmod 600"):
        config(endpoints_of(hosts, "far", keys / "far", tmp_path, "base"))
    with pytest.raises(BadEndpoint, match="steadyhand keys"):
        Identity("r1", "arm", keys / "far").files()


def test_keys_are_renewed_by_the_same_authority(tmp_path: Path) -> None:
    """Renewing one host's keys does not lock the others out."""
    hosts = Hosts.model_validate(THREE)
    keys = _keys(tmp_path, hosts)
    before = (keys / "authority.pem").read_bytes(), (keys / "arm" / "arm.pem").read_bytes()
    _keys(keys, hosts)
    assert (keys / "authority.pem").read_bytes() == before[0]
    again = (keys / "arm" / "arm.pem").read_bytes()
    assert again != before[1]
    issuer = x509.load_pem_x509_certificate(before[0])
    x509.load_pem_x509_certificate(again).verify_directly_issued_by(issuer)


def test_people_use_what_they_were_given(tmp_path: Path) -> None:
    """An operator's folder makes an operator, a watcher's a watcher."""
    hosts = Hosts.model_validate(THREE)
    keys = _keys(tmp_path, hosts)
    identity = endpoints_for_people(hosts, keys).identity
    assert identity is not None and identity.role == "operator"
    (keys / "people" / "operator.key").unlink()
    identity = endpoints_for_people(hosts, keys).identity
    assert identity is not None and identity.role == "watcher"


@pytest.mark.parametrize("scenario", scenario_names())
def test_every_service_may_hear_what_it_needs(scenario: str) -> None:
    """The table's readers are those that read: a forgotten one would be deaf with keys."""
    from sim.scenario import load_scenario

    loaded = load_scenario(scenario)
    for name in loaded.services:
        service = build_service(name, loaded, 1, live=True)
        for topic in service.inputs:
            assert name in topic.readers, f"{name} reads {topic.name}"


def test_nobody_may_say_what_is_not_his() -> None:
    """Of every topic exactly one role may be heard, and no rule allows more than the table."""
    rules = {rule["id"]: rule for rule in access_control("r1")["rules"]}
    for topic in TOPICS.values():
        may = [r for r in ROLES if f"r1/{topic.name}" in _keys_of(rules, f"{r} says (ingress)")]
        assert may == [topic.owner]
    assert set(ROLES) - {"operator", "console"} == {
        r for r in ROLES if f"{r} asks (ingress)" not in rules
    }
    assert not {r for r in PEOPLE if f"{r} says (ingress)" in rules}
    controllers = {"arm", "base", "observer", "sim"}
    assert not {r for r in controllers if "r1/sim/truth" in hears("r1", r)}


def _keys_of(rules: dict[str, dict[str, list[str]]], name: str) -> list[str]:
    return rules[name]["key_exprs"] if name in rules else []


def test_systemd_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """READY and WATCHDOG reach the socket that systemd names; without one nothing happens."""
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    notify("READY=1")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        notify("READY=1")
        assert systemd.recv(100) == b"READY=1"
    notify("WATCHDOG=1")  # nobody listens any more: that is no reason to stop


@pytest.fixture
def bad_network() -> Network:
    """Two hosts 20 ms apart, or a skip that says why."""
    try:
        with network({"a": "10.79.0.1", "b": "10.79.0.2"}, Link(delay=0.02, loss=0.2), 1) as net:
            yield net  # type: ignore[misc]
    except NotPermitted as error:
        pytest.skip(str(error))


ECHO = """
import socket
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.bind(("10.79.0.2", 9)); print("up", flush=True)
while True:
    data, who = s.recvfrom(100); s.sendto(data, who)
"""
ASK = """
import socket, time
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM); s.settimeout(0.25)
trips = []
for k in range({count}):
    start = time.monotonic(); s.sendto(b"%d" % k, ("10.79.0.2", 9))
    try:
        while s.recv(100) != b"%d" % k: pass  # answers that came later than we waited
        trips.append(time.monotonic() - start)
    except OSError: pass
print(len(trips), min(trips, default=0))
"""


@pytest.mark.processes
def test_namespaces_are_as_far_apart_as_asked(bad_network: Network) -> None:
    """A trip takes two delays at least, some packets are lost, a host that is cut hears nothing."""

    def ask(count: int) -> tuple[int, float]:
        argv = bad_network.command("a", sys.executable, "-c", ASK.format(count=count))
        done = subprocess.run(argv, capture_output=True, text=True, check=True, timeout=PATIENCE)
        out = done.stdout.split()
        return int(out[0]), float(out[1])

    argv = bad_network.command("b", sys.executable, "-c", ECHO)
    with subprocess.Popen(argv, stdout=subprocess.PIPE, text=True) as echo:
        try:
            assert echo.stdout is not None and echo.stdout.readline() == "up\n"
            answered, fastest = ask(60)
            assert 0 < answered < 60  # of 0.8 * 0.8 * 60 = 38, one in 1e11 for none lost
            assert fastest >= 0.04
            bad_network.cut("b")
            assert ask(5)[0] == 0
            bad_network.join("b")
            assert ask(20)[0] > 0
        finally:
            echo.kill()
    listed = subprocess.run(["ip", "netns"], capture_output=True, text=True, check=True).stdout
    assert bad_network.namespace("a") in listed


def test_the_unit_starts_what_there_is() -> None:
    """Options in the systemd unit are options of the command."""
    unit = (HOSTS.parent / "systemd" / "steadyhand@.service").read_text()
    command = next(line for line in unit.splitlines() if line.startswith("ExecStart="))
    argv = [sys.executable, "-m", "services.cli", "up", "--help"]
    known = subprocess.run(
        argv, capture_output=True, text=True, check=True, env={**os.environ, "COLUMNS": "200"}
    ).stdout
    for option in re.findall(r"--[a-z-]+", command):
        assert option in known
