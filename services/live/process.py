"""One service as a process: ``python -m services.live.process --service NAME ...``."""

from __future__ import annotations

from services.live import realtime

realtime.one_blas_thread()  # before anything imports numpy

# ruff: noqa: E402
import argparse
import importlib
import logging
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NoReturn

from deploy.host_file import load_hosts
from services.live.clock import EpochClock, HeardClock
from services.live.paced import run_paced
from services.live.pulse import Pulse
from services.live.runner import run_live
from services.live.standby import step_back, step_forward, wait_for_turn
from services.lockstep import Lockstep
from services.messages import Message
from services.requests import Requests
from services.service import Inbox, Service
from services.topics import PROCESSES, RECORDER, ROBOT_PROCESS, SERVICES, Topic
from services.wire.bus import Bus, open_bus
from services.wire.codec import decode, encode
from services.wire.endpoints import Endpoints, local, make_run_dir
from services.wire.places import endpoints_of

FACTORY = "services.components:build_service"
WARM_UP_TICKS = 300
WARM_UP_TIME = 0.3  # [s] at most
LAST_RESORT = 0.8  # [s] after a request to end, the process is gone whatever hangs

log = logging.getLogger("steadyhand")


def main(argv: list[str] | None = None) -> None:
    """Run a service until it is told to end; never returns.

    An exception's traceback goes to standard error, and the exit code is 1. The process leaves by
    ``os._exit``: what others left running in it must not keep a dead service alive.
    """
    options = _parser().parse_args(argv)
    if options.parent:
        realtime.die_with_parent(options.parent)
    logging.basicConfig(
        stream=sys.stderr, level=logging.INFO, format="%(asctime)s %(levelname)s %(message)s"
    )
    os.dup2(2, 1)  # one log
    try:
        _run(options)
    except BaseException:
        _fail()
    sys.stderr.flush()
    os._exit(0)


def _fail() -> NoReturn:
    """Say why and leave; nothing is closed, for closing may hang."""
    traceback.print_exc()
    sys.stderr.flush()
    os._exit(1)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="services.live.process", description=__doc__)
    parser.add_argument("--service", required=True, choices=PROCESSES)
    parser.add_argument("--scenario", type=Path, required=True)
    parser.add_argument("--run-dir", type=Path, required=True)
    parser.add_argument("--services", default=",".join(SERVICES), help="all that run, with commas")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mode", choices=("live", "paced"), default="live")
    parser.add_argument("--robot", default="r1")
    parser.add_argument("--observer", default="ekf")
    parser.add_argument("--restarted", type=int, default=0, help="so often; needs a resume then")
    parser.add_argument("--epoch", type=float, help="local monotonic time of robot time 0")
    parser.add_argument("--ticks", type=int, help="paced: end after this many ticks")
    parser.add_argument("--rt", choices=("auto", "on", "off"), default="auto")
    parser.add_argument("--listen", action="append", help="instead of the run directory's socket")
    parser.add_argument("--connect", action="append", help="instead of the run directory's sockets")
    parser.add_argument("--hosts", type=Path, help="hosts file, where not all run here")
    parser.add_argument("--host", help="which of them this is")
    parser.add_argument("--keys", type=Path, help="folder of this host's certificates")
    parser.add_argument("--log", type=Path, help="of the recorder: file to write")
    parser.add_argument("--spare", type=Path, help="get ready, then wait at this named pipe")
    parser.add_argument("--parent", type=int, help="die with this process")
    parser.add_argument("--factory", default=FACTORY, help="module:function that builds services")
    return parser


def _run(options: argparse.Namespace) -> None:
    # the loop shall not wait 5 ms for the interpreter while another thread parses a request
    sys.setswitchinterval(1e-4)
    service = _stand_by(options) if options.spare else None
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: _end(stop))
    if options.service == RECORDER:
        _record(options, stop)
        return
    live = options.mode == "live"
    if live and options.restarted:  # the others wait for us: be as important as they are at once
        realtime.favour(options.rt)
    service = service or _build(options, options.service, bool(options.restarted))
    endpoints = _endpoints(options)
    if live:
        _get_ready(options, service)
    with open_bus(endpoints, options.robot, service.name, service.inputs, not live) as bus:
        requests = Requests(bus.session, options.robot, service)
        try:
            if live:
                _live(options, service, bus, stop, requests)
            else:
                others = [name for name in _running(options) if name != ROBOT_PROCESS]
                run_paced(service, bus, stop, requests, options.ticks, others)
        except BaseException:
            _fail()
        _end(stop)  # closing may hang as well
        log.info("%s: ended", service.name)
        requests.close()


def _stand_by(options: argparse.Namespace) -> Service:
    """Do all that can be done beforehand, and wait until it is needed."""
    step_back()
    service = _build(options, options.service, restarted=True)
    warm_up(lambda name: _build(options, name), service.name, _running(options))
    wait_for_turn(options.spare)
    step_forward()
    log.info("%s: takes over", service.name)
    return service


def _endpoints(options: argparse.Namespace) -> Endpoints:
    run_dir = make_run_dir(options.run_dir)
    if options.hosts is not None:
        hosts = load_hosts(options.hosts)
        return endpoints_of(hosts, options.host, options.keys, run_dir, options.service)
    if options.listen or options.connect:
        return Endpoints(tuple(options.listen or ()), tuple(options.connect or ()))
    return local(run_dir, options.service)


def _record(options: argparse.Namespace, stop: threading.Event) -> None:
    # imported here: the other processes are back sooner after a restart without these
    from services.logs.provenance import provenance
    from services.logs.recorder import Recorder, free_name
    from sim.scenario import load_scenario

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())  # no last resort: it writes to the end
    recorder = Recorder(
        free_name(options.log or options.run_dir / "run.mcap"),
        provenance(load_scenario(options.scenario), options.seed, options.observer, options.mode),
    )
    endpoints = _endpoints(options)
    if options.mode == "live":
        log.info("%s: %s", RECORDER, realtime.favour(options.rt, realtime.RECORDER_NICE))
    with open_bus(endpoints, options.robot, RECORDER, recorder.inputs, lossless=True) as bus:
        try:
            run_live(recorder, bus, HeardClock(), stop, restarts=options.restarted)
            rest = Inbox(recorder.inputs)
            bus.drain(rest, None)
            recorder.step(0.0, rest)
            recorder.close(bus.lost, bus.refused)
        except BaseException:
            _fail()
        _end(stop)
        log.info("%s: ended", RECORDER)


def _get_ready(options: argparse.Namespace, service: Service) -> None:
    """Warm up as an ordinary program, to take nothing from loops that run; then be favoured."""
    if options.restarted:  # it comes up holding still: being back soon counts for more
        log.info("%s: restarted, no warm-up", service.name)
    else:
        ticks = warm_up(lambda name: _build(options, name), service.name, _running(options))
        log.info("%s: warm-up of %d ticks", service.name, ticks)
    log.info("%s: %s", service.name, realtime.favour(options.rt))


def _live(
    options: argparse.Namespace,
    service: Service,
    bus: Bus,
    stop: threading.Event,
    requests: Requests,
) -> None:
    for line in realtime.set_up(options.rt, SERVICES.index(service.name)):
        log.info("%s: %s", service.name, line)
    is_robot = service.name == ROBOT_PROCESS
    epoch = options.epoch if options.epoch is not None else time.monotonic()
    run_live(
        service,
        bus,
        EpochClock(epoch) if is_robot else HeardClock(),
        stop,
        requests,
        spin=realtime.spin(options.rt, service.period),
        restarts=options.restarted,
        pulse=Pulse(options.run_dir, os.getpid()),
    )


def _running(options: argparse.Namespace) -> list[str]:
    """The services of this run, in starting order."""
    return [name for name in SERVICES if name in options.services.split(",")]


def _build(options: argparse.Namespace, name: str, restarted: bool = False) -> Service:
    module, _, function = options.factory.partition(":")
    build: Any = getattr(importlib.import_module(module), function)
    service: Service = build(
        name,
        options.scenario,
        options.seed,
        options.observer,
        options.mode == "live",
        restarted,
    )
    return service


def warm_up(build: Callable[[str], Service], name: str, running: Iterable[str] = SERVICES) -> int:
    """Run copies of all services that run against each other; returns for how many ticks.

    Nobody hears them. Alone and without inputs a controller would not run the code that counts.
    What the service itself says is encoded and decoded as well.
    """

    def wire(topic: Topic, message: Message, _: float) -> None:
        if topic.owner == name or topic.name in heard:
            decode(topic, encode(topic.owner, 0, message))

    services = [build(other) for other in running]
    heard = {t.name for service in services if service.name == name for t in service.inputs}
    rehearsal, deadline = Lockstep(services, listener=wire), time.monotonic() + WARM_UP_TIME
    while rehearsal.tick < WARM_UP_TICKS and time.monotonic() < deadline:
        rehearsal.step()
    return rehearsal.tick


def _end(stop: threading.Event) -> None:
    """Ask the loop to end, and see to it that the process does."""
    stop.set()
    timer = threading.Timer(LAST_RESORT, os._exit, (0,))
    timer.daemon = True
    timer.start()


if __name__ == "__main__":
    main()
