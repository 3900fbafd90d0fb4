"""Logs keep what was said, and when it could be heard."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from mcap.reader import make_reader

from services.logs.recorder import Recorder
from services.logs.runlog import RunLog, read_log
from services.messages import ArmState, Imu, Odometry
from services.run import run_lockstep
from services.service import Inbox
from services.topics import ARM_STATE, IMU, ODOMETRY
from sim.scenario import Scenario


def test_a_log_says_how_late_a_sensor_was(tmp_path: Path) -> None:
    """Arrival survives the file: odometry 20 ms after its stamp, the IMU 10 ms."""
    log = run_lockstep(Scenario(), 1, duration=0.5).log
    log.write(tmp_path / "run.mcap", {})
    again, _ = read_log(tmp_path / "run.mcap")
    for topic, delay in ((ODOMETRY, 0.020), (IMU, 0.010)):
        stamps = np.array([m.t for m in again.series(topic)])
        arrivals = np.array(again.arrivals(topic))
        np.testing.assert_allclose(arrivals, log.arrivals(topic), atol=1e-9)
        np.testing.assert_allclose((arrivals - stamps)[1:], delay, atol=0.0011)


def test_a_log_is_in_order_of_arrival(tmp_path: Path) -> None:
    """Messages lie in the file in the order of ``log_time``, with their stamp beside it."""
    log = run_lockstep(Scenario(), 1, duration=0.3).log
    log.write(tmp_path / "run.mcap", {})
    with (tmp_path / "run.mcap").open("rb") as stream:
        records = [
            (channel.topic, record)
            for _, channel, record in make_reader(stream).iter_messages(log_time_order=False)
        ]
    times = [record.log_time for _, record in records]
    assert times == sorted(times)
    late = {r.log_time - r.publish_time for name, r in records if name == "robot/odometry"}
    assert late == {20_000_000}


def test_two_runs_write_the_same_bytes(tmp_path: Path) -> None:
    """Scenario and seed decide the file, arrival times included."""
    first, second = (
        run_lockstep(Scenario(), 3, duration=0.2).log.write(tmp_path / name, {}) for name in "ab"
    )
    assert first == second
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_a_log_without_arrivals_has_the_stamps() -> None:
    """Who does not know when a message came says nothing, and its stamp stands for it."""
    log = RunLog()
    log(ODOMETRY, Odometry(t=1.5, pose=np.zeros(3)))
    assert log.arrivals(ODOMETRY) == [1.5]
    assert log.arrivals(IMU) == []


def test_the_recorder_tells_arrival_by_the_newest_robot_time(tmp_path: Path) -> None:
    """However rarely it steps, a message arrived when robot time was where the robot said."""
    recorder = Recorder(tmp_path / "run.mcap", {})
    inbox = Inbox(recorder.inputs)
    zero = np.zeros(6)
    for tick in range(40):  # local time runs at half the pace of robot time
        t, local = 0.001 * tick, 0.002 * tick
        state = ArmState(t=t, q=zero, qd=zero, tau=zero, wrench=zero)
        inbox.offer(ARM_STATE, state, local)
        if tick == 30:
            inbox.offer(ODOMETRY, Odometry(t=0.010, pose=np.zeros(3)), local + 1e-4)
            inbox.offer(IMU, Imu(t=0.015, gyro=np.zeros(3), accel=np.zeros(3)), local - 1e-4)
    recorder.step(9.9, inbox)
    recorder.close({}, {})
    log, _ = read_log(tmp_path / "run.mcap")
    assert log.arrivals(ODOMETRY) == [0.030]
    assert log.arrivals(IMU) == [0.029]


def test_a_topic_that_is_emptied_late_does_not_run_ahead(tmp_path: Path) -> None:
    """What arrived while others were being emptied waits for what arrived beside it."""
    recorder = Recorder(tmp_path / "run.mcap", {})
    zero = np.zeros(3)
    first, second = Inbox(recorder.inputs), Inbox(recorder.inputs)
    first.offer(ODOMETRY, Odometry(t=0.00, pose=zero), 1.00)
    # emptied last, it had heard until 1.09 when odometry had been emptied at 1.01
    for tick in range(10):
        clock = Imu(t=0.01 * tick, gyro=zero, accel=zero)
        first.offer(IMU, clock, 1.0 + 0.01 * tick)
    second.offer(ODOMETRY, Odometry(t=0.02, pose=zero), 1.04)
    recorder.step(0.0, first)
    recorder.step(0.0, second)
    recorder.close({}, {})
    log, _ = read_log(tmp_path / "run.mcap")
    assert log.arrivals(ODOMETRY) == [0.0, 0.04]
    assert log.arrivals(IMU) == [round(0.01 * tick, 2) for tick in range(10)]
