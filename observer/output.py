"""The smooth output: what the filter believes, without a step in pose or velocity.

The filter's belief jumps at every measurement. A torque law that fed pose, velocity and
acceleration forward would answer each jump with a jerk. So the output has a state of its own, pose
and velocity in O. It advances with the filter's own prediction (command, disturbance, turn: the
freshest knowledge of acceleration), and what the filter learnt since is fed in by a critically
damped second-order law of which both the rate and the acceleration are bounded::

    c = limit(k/4 (p_filter - p), rate)              wanted velocity of correction
    a = limit(k (v_filter + c - v), acceleration)    acceleration of correction
    v <- v + (increment of the prediction) + a dt
    p <- p + dt (v_before + v) / 2

With k = 2 w the error obeys e'' + 2 w e' + w^2 e = 0. The error is taken afresh at every tick in O
at the present instant, so a correction never acts about an axis of the past (the fault that PX4 had
above 7 rad/s). Velocity is the derivative of pose by construction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from observer.motion_model import Floats
from observer.sensor_models import wrap


@dataclass(frozen=True)
class OutputOptions:
    """Constants of the blend, found by measurement (docs/observer.md)."""

    frequency: tuple[float, float] = (60.0, 45.0)
    """w of the critically damped law, of translation and of heading [rad/s]."""
    excess: tuple[float, float] = (0.0198, math.radians(1.4))
    """By how much the velocity given out may differ from the true one: translation [m/s], heading
    [rad/s]. A correction gets what the uncertainty of the velocity leaves of it ..."""
    sigmas: float = 3.3
    """... which is taken as so many standard deviations; about one in a thousand is larger."""
    least: float = 0.25
    """A correction gets at least this share."""
    acceleration: tuple[float, float] = (1.5, 1.0)
    """Largest acceleration of a correction [m/s^2], [rad/s^2]: the arm's reaction to more shakes
    the platform, and that the filter then sees."""
    far: tuple[float, float] = (0.004, math.radians(1.0))
    """Beyond this error the rate grows in proportion, so that a way back of decimetres ends."""


class SmoothOutput:
    """Pose and velocity in O that follow the filter without steps.

    Attributes:
        pose: X_OB: x, y [m], heading [rad], continuous.
        velocity: V_OB_O [m/s, m/s, rad/s], the derivative of ``pose``.
        offset: filter minus output [m, m, rad], what is still to be fed in.
        rate: largest velocity of a correction now: translation [m/s], heading [rad/s].
    """

    def __init__(self, options: OutputOptions | None = None) -> None:
        self.options = options or OutputOptions()
        self.pose = [0.0, 0.0, 0.0]
        self.velocity = [0.0, 0.0, 0.0]
        self.offset = [0.0, 0.0, 0.0]
        self.rate = (0.0, 0.0)
        self.trust((0.0, 0.0))
        self._tune(0.002)

    def trust(self, sigma: tuple[float, float]) -> None:
        """Tell how far the velocity is known: standard deviation [m/s], [rad/s]."""
        o = self.options
        left = [
            max(most - o.sigmas * s, o.least * most)
            for most, s in zip(o.excess, sigma, strict=True)
        ]
        self.rate = (left[0], left[1])

    def reset(self, pose: Floats, velocity: Floats) -> None:
        """Start at the filter's belief: the only step there ever is."""
        self.pose, self.velocity = list(pose[:3]), list(velocity)
        self.offset = [0.0, 0.0, 0.0]

    def step(self, dt: float, increment: Floats, pose: Floats, velocity: Floats) -> None:
        """Advance by ``dt`` to now.

        Args:
            dt: time since the last step [s], positive.
            increment: of V_OB_O over ``dt`` by the filter's own prediction, without corrections.
            pose: X_OB that the filter believes now, in its first three entries.
            velocity: V_OB_O that the filter believes now.
        """
        if abs(dt - self._dt) > 1e-9:  # sums of periods differ in their last digits
            self._tune(dt)
        half, pull, gain, most, pull_w, gain_w, most_w = self._law
        p, v = self.pose, self.velocity
        vx, vy, vw = v
        wx, wy, ww = vx + increment[0], vy + increment[1], vw + increment[2]
        ex = pose[0] - p[0] - half * (vx + wx)
        ey = pose[1] - p[1] - half * (vy + wy)
        ew = pose[2] - p[2] - half * (vw + ww)
        if not -math.pi <= ew < math.pi:
            ew = wrap(ew)

        rate, rate_w = self.rate
        far, far_w = self.options.far
        error = math.hypot(ex, ey)
        if error > far:
            rate *= error / far
        c = pull if pull * error <= rate else rate / error
        ax = gain * (velocity[0] + c * ex - wx)
        ay = gain * (velocity[1] + c * ey - wy)
        size = math.hypot(ax, ay)
        if size > most:
            ax, ay = ax * most / size, ay * most / size

        if abs(ew) > far_w:
            rate_w *= abs(ew) / far_w
        cw = pull_w * ew
        cw = rate_w if cw > rate_w else -rate_w if cw < -rate_w else cw
        aw = gain_w * (velocity[2] + cw - ww)
        aw = most_w if aw > most_w else -most_w if aw < -most_w else aw

        nx, ny, nw = wx + ax, wy + ay, ww + aw
        self.pose = [p[0] + half * (vx + nx), p[1] + half * (vy + ny), p[2] + half * (vw + nw)]
        self.velocity = [nx, ny, nw]
        self.offset = [ex - half * ax, ey - half * ay, ew - half * aw]

    def _tune(self, dt: float) -> None:
        """Constants of the law for ticks of ``dt`` [s]."""
        law = [0.5 * dt]
        for frequency, most in zip(self.options.frequency, self.options.acceleration, strict=True):
            # however coarse the ticks, never past the target
            pull = min(0.5 * frequency, 0.5 / dt)
            law += [pull, -math.expm1(-2.0 * frequency * dt), most * dt]
        self._dt, self._law = dt, law
