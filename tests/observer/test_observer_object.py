"""The box estimator: what it claims to know, and what touch adds."""

from __future__ import annotations

import numpy as np
import pytest

from deploy.robot import TwoArmRobot, load_robot
from observer.object_estimator import ObjectEstimator
from observer.palm_touch import Touch
from services.messages import Estimate, ObjectEstimate, Vision

ROBOT = load_robot("rmp_two_arms", TwoArmRobot)
BOX = np.array([0.62, 0.03, 0.84])


def estimate(t: float) -> Estimate:
    """The platform stands at the origin."""
    return Estimate(
        t=t,
        pose=np.zeros(3),
        velocity=np.zeros(3),
        acceleration=np.zeros(3),
        covariance=np.eye(6) * 1e-6,
        gyro_bias=0.0,
        accel_bias=np.zeros(2),
        odometry_innovation=np.zeros(3),
        odometry_nis=0.0,
        imu_innovation=np.zeros(3),
        imu_nis=0.0,
        odometry_age=0.0,
        imu_age=0.0,
        command_age=0.0,
    )


def watch(
    seed: int,
    seconds: float = 3.0,
    touched: bool = False,
    moved: float | None = None,
    factor: float = 1.25,
    quarters: int = 0,
) -> tuple[ObjectEstimate, np.ndarray]:
    """What is believed after a while of pictures that err alike for a second; and the truth."""
    assert ROBOT.vision is not None
    rng = np.random.default_rng(seed)
    estimator = ObjectEstimator(ROBOT.vision)
    spread = np.array([0.005] * 3 + [0.01] * 3)
    keep = np.exp(-1.0 / (ROBOT.vision.rate * ROBOT.vision.correlation))
    error = rng.standard_normal(6)
    box = BOX.copy()
    last: ObjectEstimate | None = None
    for i in range(round(seconds / 0.008)):
        t = 0.008 * i
        if moved is not None and abs(t - moved) < 0.004:
            box = box + np.array([0.05, 0.1, 0.0])
        pictures = []
        if i % 5 == 0:
            error = keep * error + np.sqrt(1 - keep**2) * rng.standard_normal(6)
            e = factor * spread * error
            turn = np.array([[1, -e[5], e[4]], [e[5], 1, -e[3]], [-e[4], e[3], 1]])
            R = np.linalg.qr(turn)[0]
            R = R * np.sign(np.diag(R)) @ _quarter(quarters)
            pictures = [Vision(t=t, p=box + e[:3], R=R, covariance=np.diag(spread**2), name="box")]
        touch = None
        if touched and t > 1.5:
            side = np.array([0.0, 0.1395, 0.0])
            noise = np.array([0.0, 1e-3 * rng.standard_normal(), 0.0])
            points = (box + side + noise, box - side + noise)
            touch = Touch(points, None, False, np.array([0.0, 1.0, 0.0]))
        last = estimator.step(estimate(t), pictures, touch) or last
    assert last is not None
    return last, box


def test_the_stated_covariance_can_be_believed() -> None:
    """NEES of 60 trials is 6 within the band of 99 %, position and rotation together."""
    values = []
    for seed in range(60):
        last, box = watch(seed)
        e = np.concatenate([box - last.p, _turn(last.R)])
        values.append(float(e @ np.linalg.solve(last.covariance, e)))
    assert 4.9 < np.mean(values) < 7.2


def test_flat_palms_see_across_and_not_along() -> None:
    """Touch narrows y tenfold in variance, and leaves x as vision has it."""
    seen, _ = watch(1)
    felt, box = watch(1, touched=True)
    assert felt.covariance[1, 1] < 0.1 * seen.covariance[1, 1]
    assert felt.covariance[0, 0] == pytest.approx(seen.covariance[0, 0], rel=0.05)
    assert abs(felt.p[1] - box[1]) < 0.003


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_palms_may_be_on_any_two_faces(quarters: int) -> None:
    """Of a box turned by quarters touch says the same as of one that is not."""
    straight, _ = watch(1, touched=True)
    turned, box = watch(1, touched=True, quarters=quarters)
    R = turned.R @ _quarter(quarters).T
    assert pytest.approx(straight.R, abs=1e-6) == R
    assert turned.covariance == pytest.approx(straight.covariance, abs=1e-9)
    assert abs(turned.p[1] - box[1]) < 0.003


def test_a_box_that_was_moved_is_found_again() -> None:
    """A second after a jump of 11 cm the estimate is there."""
    last, box = watch(2, moved=2.0)
    assert np.linalg.norm(last.p - box) < 0.03


def _quarter(n: int) -> np.ndarray:
    """About z, n times."""
    return np.linalg.matrix_power(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0, 0, 1.0]]), n)


def _turn(R: np.ndarray) -> np.ndarray:
    """Rotation from what is believed to the truth, which is none."""
    return 0.5 * np.array([R[1, 2] - R[2, 1], R[2, 0] - R[0, 2], R[0, 1] - R[1, 0]])
