"""Toy services that speak real topics: small enough to see through, chaotic enough to differ."""

from __future__ import annotations

import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from services import messages as m
from services import topics
from services.service import Inbox, Outbox, Reply, Service


class Toy:
    """A logistic map stirred by everything that is heard, in the order in which it is heard."""

    name = "toy"
    period = 0.001
    inputs: tuple[topics.Topic, ...] = ()
    verbs: tuple[str, ...] = ("stir",)

    def __init__(self, seed: int) -> None:
        self.x = float(np.random.default_rng([seed, len(self.name)]).uniform(0.1, 0.9))
        self.steps = 0

    def stir(self, value: float) -> None:
        """One step of the map, pushed by a value."""
        x = 3.99 * self.x * (1 - self.x)
        self.x = (x + abs(value)) % 0.98 + 0.01

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Hear everything, then speak."""
        self.steps += 1
        for topic in self.inputs:
            for message in inbox.new(topic):
                self.stir(message.t)
                self.stir(float(np.sum(self.read(message))))
            age = inbox.age(topic, now)
            self.stir(age if np.isfinite(age) else 0.5)
        return self.speak(now)

    def read(self, message: m.Message) -> Any:
        """The number in a message."""
        for name in ("tau", "velocity", "pose", "q"):
            if hasattr(message, name):
                return getattr(message, name)
        return 0.0

    def speak(self, now: float) -> Outbox:
        """What to publish."""
        raise NotImplementedError

    def prepare(self, verb: str, args: dict[str, Any]) -> Callable[[], Reply]:
        """``stir value=X``; ``value`` must be a number."""
        value = args.get("value")
        if not isinstance(value, (int, float)):
            raise ValueError("stir needs value=NUMBER")

        def action() -> Reply:
            self.stir(float(value))
            return Reply(True)

        return action

    def state(self) -> tuple[str, str]:
        """Always well."""
        return "running", f"x = {self.x:.3f}"


class ToySim(Toy):
    """A robot."""

    name = "sim"
    inputs = (topics.ARM_COMMAND, topics.BASE_COMMAND)

    def speak(self, now: float) -> Outbox:
        """Arm state every tick, odometry every 50th, two of them in one tick now and then."""
        zeros = np.zeros(6)
        out: Outbox = [(topics.ARM_STATE, m.ArmState(now, np.full(6, self.x), zeros, zeros, zeros))]
        if self.steps % 50 == 1:
            out.append((topics.ODOMETRY, m.Odometry(max(0.0, now - 0.02), np.full(3, self.x))))
        if self.steps % 150 == 1:
            out.append((topics.ODOMETRY, m.Odometry(now, np.full(3, -self.x))))
        return out


class ToyObserver(Toy):
    """An estimate, and status in containers."""

    name = "observer"
    period = 0.002
    inputs = (topics.ODOMETRY, topics.BASE_COMMAND)

    def speak(self, now: float) -> Outbox:
        """An estimate each step."""
        three = np.full(3, self.x)
        estimate = m.Estimate(
            t=now, pose=three, velocity=-three, acceleration=three / 3, covariance=np.eye(6),
            gyro_bias=self.x, accel_bias=np.zeros(2), odometry_innovation=three,
            odometry_nis=1.0, imu_innovation=three, imu_nis=1.0, odometry_age=0.0, imu_age=0.0,
            command_age=0.0, rejected={"gate": self.steps},
        )  # fmt: skip
        return [(topics.ESTIMATE, estimate)]


class ToyBase(Toy):
    """Slower than the others."""

    name = "base"
    period = 0.05
    inputs = (topics.ODOMETRY, topics.ESTIMATE, topics.ARM_STATUS)

    def speak(self, now: float) -> Outbox:
        """Command and status."""
        status = m.BaseStatus(now, "driving", "", {"line": [self.x, 0.0, 0.0, 1.0]}, np.ones(3))
        command = m.BaseCommand(now, np.array([self.x, -self.x, 0.1]))
        return [(topics.BASE_COMMAND, command), (topics.BASE_STATUS, status)]


class ToyArm(Toy):
    """Commands each tick, status each 20th."""

    name = "arm"
    inputs = (topics.ARM_STATE, topics.ESTIMATE)

    def speak(self, now: float) -> Outbox:
        """Torques and status."""
        out: Outbox = [(topics.ARM_COMMAND, m.ArmCommand(now, np.full(6, self.x)))]
        if self.steps % 20 == 1:
            out.append((topics.ARM_STATUS, m.ArmStatus(now, "running", transitions=self.steps)))
        return out


TOYS: dict[str, type[Toy]] = {toy.name: toy for toy in (ToySim, ToyObserver, ToyBase, ToyArm)}


def build(
    name: str, scenario: Path, seed: int, observer: str, live: bool, restarted: bool
) -> Service:
    """The same signature as ``services.components.build_service``."""
    return TOYS[name](seed)


def build_lockable(name: str, *args: Any, **options: Any) -> Service:
    """A toy that holds the interpreter's lock for ever once it gets ``SIGUSR2``."""

    def lock(*_: object) -> None:
        re.match("(a+)+$", 60 * "a" + "b")  # a C function that lets nobody else in

    signal.signal(signal.SIGUSR2, lock)
    return build(name, *args, **options)
