"""Recordings from files: our own logs, run folders, and plain form (TOML and CSV)."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from deploy.robot import load_robot
from observer.recordings.recording import Recording, Samples
from services.lockstep import TICK
from services.logs.runlog import BadLog, RunLog, read_run
from services.messages import Array, Message
from services.topics import BASE_COMMAND, IMU, ODOMETRY, TRUTH, Topic
from sim.scenario import Scenario

LATE = 1.0
"""A message that is overtaken is stamped at most this long before the newest [s]."""


def open_recording(path: Path) -> Recording:
    """Read a recording from an ``.mcap`` log of ours, a run's folder, or a plain form's TOML.

    Raises:
        BadLog: no such file, no log of ours, or one without odometry.
        BadFile: a plain form with wrong entries.
    """
    if path.suffix == ".toml":
        from observer.recordings.load import load_recording

        return load_recording(path)
    if path.suffix != ".mcap" and not path.is_dir():
        raise BadLog(f"{path}: neither a log (.mcap), a run's folder, nor a recording (.toml)")
    log, about, _ = read_run(path, (ODOMETRY, IMU, BASE_COMMAND, TRUTH))
    if path.is_dir():
        return recording_of(log, about, path.resolve().name)
    return recording_of(log, about, path.stem if path.parent == Path() else path.parent.name)


def recording_of(log: RunLog, about: Mapping[str, str], name: str = "run") -> Recording:
    """What the observer heard in a run of ours, with the truth as reference.

    The robot is the one that the run's controllers were told of, not the simulated one. A message
    could be used one tick after it was sent. Truth is X_WB: O is W until the wheels slip.

    Args:
        log: of the run.
        about: its metadata.
        name: for titles.

    Raises:
        BadLog: no odometry, a robot that is not known here, or stamps that repeat or go back.
    """
    if not log.series(ODOMETRY):
        raise BadLog(f"{name}: nothing on {ODOMETRY.name}; there is nothing to replay")
    truth = log.series(TRUTH)
    return Recording(
        name=name,
        base=load_robot(_robot(about)),
        odometry=_samples(log, ODOMETRY, [m.pose for m in log.series(ODOMETRY)]),
        imu=_samples(log, IMU, [np.concatenate([m.gyro, m.accel]) for m in log.series(IMU)]),
        commands=_samples(log, BASE_COMMAND, [m.velocity for m in log.series(BASE_COMMAND)]),
        reference=_samples(log, TRUTH, [m.pose for m in truth]),
    )


def _robot(about: Mapping[str, str]) -> str:
    """Name of the robot that a log is of."""
    try:
        scenario = tomllib.loads(about.get("scenario_toml", ""))
    except tomllib.TOMLDecodeError as error:
        raise BadLog(f"the log's scenario is not TOML: {error}") from None
    return str(scenario.get("robot", Scenario.model_fields["robot"].default))


def _samples(log: RunLog, topic: Topic, values: Sequence[Array]) -> Samples | None:
    """Samples in the order of their stamps; None if the topic is silent.

    A base that steps twice while robot time is late gives two commands one stamp: the later counts.

    Raises:
        BadLog: two samples of one instant, or stamps that go back by more than ``LATE``.
    """
    messages: list[Message] = log.series(topic)
    if not messages:
        return None
    t = np.array([m.t for m in messages])
    arrival = np.maximum(np.array(log.arrivals(topic)), t) + TICK
    back = np.flatnonzero(np.diff(t) < -LATE)
    if len(back):
        k = int(back[0])
        raise BadLog(
            f"stamps of {topic.name} go back from {t[k]:.3f} to {t[k + 1]:.3f} s: two runs in one"
            " log, or a simulation that was restarted"
        )
    order = np.argsort(t, kind="stable")
    if topic is BASE_COMMAND:
        order = order[np.append(np.diff(t[order]) > 0.0, True)]
    same = np.flatnonzero(np.diff(t[order]) == 0.0)
    if len(same):
        raise BadLog(f"two messages on {topic.name} have one stamp, {t[order][same[0]]:.3f} s")
    return Samples(t[order], arrival[order], np.array(values)[order])
