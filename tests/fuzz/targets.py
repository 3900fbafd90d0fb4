"""What is fuzzed: readers of bytes, each with good seeds and the only error it may raise."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import msgpack
import numpy as np

from arm.hds import check_text
from arm.nodes import REGISTRY
from deploy.host_file import HOSTS, load_hosts
from deploy.task import PROGRAMS
from deploy.tomlfile import BadFile
from observer.recordings.table import BadTable, Table
from services import messages as m
from services.logs.runlog import BadLog, LogWriter, read_log
from services.messages import BadMessage
from services.topics import ARM_COMMAND, ESTIMATE, ODOMETRY, TOPICS
from services.wire.codec import decode, encode, unpack_map
from sim.scenario import SCENARIOS, load_scenario

CORPUS = Path(__file__).parent / "corpus"


@dataclass(frozen=True)
class Target:
    """A reader.

    Attributes:
        read: takes bytes; whatever they are, it returns or raises one of ``refuses``.
        refuses: errors that say no.
        seeds: good inputs to start from.
        covers: parts of file names whose lines count as ways through the code.
    """

    read: Callable[[bytes], object]
    refuses: tuple[type[Exception], ...]
    seeds: Callable[[], Iterator[bytes]]
    covers: tuple[str, ...]


def _wire(data: bytes) -> object:
    """The first byte says on which topic."""
    topics = list(TOPICS.values())
    return decode(topics[data[0] % len(topics)] if data else topics[0], data[1:])


def _wire_seeds() -> Iterator[bytes]:
    three, names = np.zeros(3), list(TOPICS)
    yield bytes([names.index(ODOMETRY.name)]) + encode("sim", 1, m.Odometry(1.0, three))
    yield bytes([names.index(ARM_COMMAND.name)]) + encode("arm", 1, m.ArmCommand(1.0, np.ones(6)))
    status = m.BaseStatus(1.0, "driving", "", {"line": [1.0, 2.0]}, three)
    yield bytes([names.index("base/status")]) + encode("base", 1, status)
    yield bytes([names.index("arm/status")]) + encode("arm", 1, m.ArmStatus(1.0))
    health = m.Health(1.0, "arm", "running", "", 1, 1, {"mean": 1e-3}, {}, 0, {}, {})
    yield bytes([names.index("arm/health")]) + encode("arm", 2, health)
    estimate = m.Estimate(
        1.0, three, three, three, np.eye(6), 0.0, np.zeros(2), three, 0.0, three, 0.0, 0.0, 0.0, 0.0
    )
    yield bytes([names.index(ESTIMATE.name)]) + encode("observer", 1, estimate)


def _in_file(name: str, read: Callable[[Path], object]) -> Callable[[bytes], object]:
    folder = Path(tempfile.mkdtemp(prefix="fuzz"))

    def from_bytes(data: bytes) -> object:
        path = folder / name
        path.write_bytes(data)
        return read(path)

    return from_bytes


def _program(data: bytes) -> object:
    return check_text(data.decode("utf-8", "replace"), "fuzzed.hds", REGISTRY)


def _files(folder: Path, pattern: str) -> Callable[[], Iterator[bytes]]:
    return lambda: (path.read_bytes() for path in sorted(folder.glob(pattern))[:6])


def _log_seeds() -> Iterator[bytes]:
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "run.mcap"
        with LogWriter(path, {"scenario_toml": ""}) as writer:
            for k in range(3):
                writer.add(ODOMETRY, m.Odometry(0.1 * k, np.zeros(3)), 0.1 * k)
        yield path.read_bytes()


def _csv(path: Path) -> object:

    return Table.read(path)


def _csv_seeds() -> Iterator[bytes]:
    yield b"t,x,y\n0.0,1.0,2.0\n0.1,1.5,2.5\n"
    yield "t;x;höhe\n0,1;2;\n# said\n1e3;-4;nan\n".encode("latin-1")
    yield b'"t","x"\r\n1,2\r\n\r\n"3",""\r\n'
    out = io.StringIO()
    np.savetxt(out, np.arange(12.0).reshape(4, 3), delimiter="\t")
    yield out.getvalue().encode()


def _arguments_seeds() -> Iterator[bytes]:
    yield msgpack.packb({"kind": "push", "force": 80.0, "on": "link2"})
    yield msgpack.packb({})


def targets() -> dict[str, Target]:
    """All readers, by name."""
    return {
        "wire": Target(_wire, (BadMessage,), _wire_seeds, ("wire/codec", "services/messages")),
        "request": Target(unpack_map, (BadMessage,), _arguments_seeds, ("wire/codec",)),
        "program": Target(_program, (), _files(PROGRAMS, "*.hds"), ("arm/hds",)),
        "scenario": Target(
            _in_file("fuzzed.toml", load_scenario),
            (BadFile,),
            _files(SCENARIOS, "*.toml"),
            ("sim/scenario", "deploy/t", "sim/obstacle", "sim/disturbance"),
        ),
        "hosts": Target(
            _in_file("hosts.toml", load_hosts), (BadFile,), _files(HOSTS, "*.toml"), ("deploy/",)
        ),
        "log": Target(
            _in_file("run.mcap", read_log), (BadLog,), _log_seeds, ("logs/runlog", "mcap/")
        ),
        "csv": Target(_in_file("x.csv", _csv), (BadTable,), _csv_seeds, ("logs/table",)),
    }
