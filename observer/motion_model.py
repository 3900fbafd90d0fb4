"""How a planar platform moves: first-order response to its command, plus a random disturbance.

State ``x`` (14)::

    x, y, heading      X_OB, heading continuous           [m, m, rad]
    vx, vy, w          velocity of B in O, seen in B      [m/s, m/s, rad/s]
    dx, dy, dw         disturbance acceleration in B      [m/s^2, m/s^2, rad/s^2]
    bg                 gyro bias                          [rad/s]
    bax, bay           accelerometer biases               [m/s^2]
    gx, gy             gravity along a tilted floor, in O [m/s^2]

Per body axis, with command ``u``, lag ``tau`` and correlation time ``T``::

    v' = clip((u - v) / tau, +-limit) + d          d' = -d / T + noise

which is linear while ``u`` is constant, so velocity and displacement have a closed form. Only the
turn of the displacement into O is approximate: it uses the heading half-way (error of second order
in the angle turned per step, 1e-9 m at 1 rad/s, 0.3 m/s and 2 ms).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from services.messages import Array

SIZE = 14

Floats = Sequence[float]

# where noise depends on the heading: x, y with themselves, with vx, vy and with dx, dy
_NOISE_ROWS = np.array([0, 0, 1, 1] + [0, 0, 1, 1] * 2 + [3, 4, 3, 4] + [6, 7, 6, 7])
_NOISE_COLUMNS = np.array([0, 1, 0, 1] + [3, 4, 3, 4] + [6, 7, 6, 7] + [0, 0, 1, 1] * 2)
_KEPT = 512
"""Durations whose constants are remembered: ticks and sensor periods come again and again."""


class _Constants(NamedTuple):
    """What a duration makes of the equations, per unit of its cause."""

    gone: float
    """Share of the gap to the command closed."""
    decay: float
    """Share of the disturbance left."""
    lost: float
    """Displacement missing per unit of gap [s]."""
    gained: float
    """Velocity per disturbance [s]."""
    moved: float
    """Displacement per disturbance [s^2]."""
    free_gained: float
    """The same two while the drive saturates."""
    free_moved: float


_Pair = tuple[float, float]
_Axes = tuple[Array, _Pair, _Pair, _Pair]
_Noise = tuple[Array, _Pair, _Pair, _Pair]


@dataclass(frozen=True)
class MotionModel:
    """First-order drive with disturbance.

    Args:
        lag: time constant of the drive, tau [s].
        acceleration_limit: of the drive along vx, vy [m/s^2] and yaw [rad/s^2].
        disturbance: standard deviation of the disturbance acceleration, stationary
            [m/s^2, m/s^2, rad/s^2].
        correlation: its correlation time, T [s]; must differ from ``lag`` by 1 % at least.
        gyro_bias_walk: random walk of the gyro bias [rad/s per sqrt(s)].
        accel_bias_walk: random walk of the accelerometer biases [m/s^2 per sqrt(s)].
        tilt_walk: random walk of the floor's tilt, as gravity along it [m/s^2 per sqrt(s)].

    Raises:
        ValueError: a time constant that is not positive, or ``correlation`` too close to ``lag``.
    """

    lag: float
    acceleration_limit: tuple[float, float, float]
    disturbance: tuple[float, float, float]
    correlation: float = 0.3
    gyro_bias_walk: float = 2e-5
    accel_bias_walk: float = 2e-4
    tilt_walk: float = 2e-4
    _constants: dict[float, _Constants] = field(default_factory=dict, compare=False, repr=False)
    _axes: dict[tuple[float, tuple[bool, ...]], _Axes] = field(
        default_factory=dict, compare=False, repr=False
    )
    _noises: dict[tuple[float, float], _Noise] = field(
        default_factory=dict, compare=False, repr=False
    )

    def __post_init__(self) -> None:
        if not (self.lag > 0 and self.correlation > 0):
            raise ValueError("lag and correlation must be positive [s]")
        if abs(self.lag - self.correlation) < 0.01 * self.lag:
            raise ValueError(
                f"correlation {self.correlation} s must differ from lag {self.lag} s by 1 % at"
                " least: the closed form divides by their difference"
            )

    def acceleration(self, x: Floats, u: Floats) -> tuple[float, float, float]:
        """Derivative of the body velocity: of vx, vy [m/s^2] and w [rad/s^2].

        Args:
            x: state (14).
            u: command V_OB_B (3) [m/s, m/s, rad/s].
        """
        lag, (lx, ly, lw) = self.lag, self.acceleration_limit
        ax, ay, aw = (u[0] - x[3]) / lag, (u[1] - x[4]) / lag, (u[2] - x[5]) / lag
        if not (-lx <= ax <= lx and -ly <= ay <= ly and -lw <= aw <= lw):
            ax, ay, aw = min(max(ax, -lx), lx), min(max(ay, -ly), ly), min(max(aw, -lw), lw)
        return ax + x[6], ay + x[7], aw + x[8]

    def slopes(self, x: Floats, u: Floats) -> list[float]:
        """Derivative of `acceleration` in vx, vy, w (3) [1/s]: zero where the drive saturates."""
        reach = self._reach
        return [-1.0 / self.lag if abs(u[i] - x[3 + i]) <= reach[i] else 0.0 for i in (0, 1, 2)]

    def _for(self, dt: float) -> _Constants:
        known = self._constants.get(dt)
        if known is not None:
            return known
        lag, corr = self.lag, self.correlation
        one_e = -math.expm1(-dt / lag)
        one_c = -math.expm1(-dt / corr)
        k = 1.0 / (1.0 / lag - 1.0 / corr)
        lost, h0 = lag * one_e, corr * one_c
        c = _Constants(
            gone=one_e,
            decay=1.0 - one_c,
            lost=lost,
            gained=k * (one_e - one_c),
            moved=k * (h0 - lost),
            free_gained=h0,
            free_moved=corr * (dt - h0),
        )
        if len(self._constants) >= _KEPT:
            self._constants.clear()
        self._constants[dt] = c
        return c

    @cached_property
    def _reach(self) -> tuple[float, float, float]:
        """Gap between command and velocity at which the drive saturates (3)."""
        x, y, w = self.acceleration_limit
        return x * self.lag, y * self.lag, w * self.lag

    def _shift(self, x: Floats, u: Floats, dt: float) -> tuple[Floats, Floats, float]:
        """Velocity after ``dt``, displacement in B (3), and decay of the disturbance."""
        k, (lx, ly, lw) = self._for(dt), self._reach
        gone, decay, lost, gained, moved, _, _ = k
        _, _, _, vx, vy, w, dx, dy, dw, _, _, _, _, _ = x
        ux, uy, uw = u
        gx, gy, gw = ux - vx, uy - vy, uw - w
        if -lx <= gx <= lx and -ly <= gy <= ly and -lw <= gw <= lw:  # nearly always: no loop
            return (
                (
                    vx + gx * gone + dx * gained,
                    vy + gy * gone + dy * gained,
                    w + gw * gone + dw * gained,
                ),
                (
                    ux * dt - gx * lost + dx * moved,
                    uy * dt - gy * lost + dy * moved,
                    uw * dt - gw * lost + dw * moved,
                ),
                decay,
            )
        velocity, shift = [], []
        for i, most in enumerate(self._reach):
            v, d, gap = x[3 + i], x[6 + i], u[i] - x[3 + i]
            if -most <= gap <= most:
                velocity.append(v + gap * gone + d * gained)
                shift.append(u[i] * dt - gap * lost + d * moved)
            else:
                a = math.copysign(self.acceleration_limit[i], gap)
                velocity.append(v + a * dt + d * k.free_gained)
                shift.append((v + 0.5 * a * dt) * dt + d * k.free_moved)
        return velocity, shift, decay

    def advance(self, x: Floats, u: Floats, dt: float) -> list[float]:
        """State after ``dt`` seconds of constant command.

        Args:
            x: state (14).
            u: command V_OB_B (3).
            dt: duration [s], not negative.

        Returns:
            State (14) as a list: scalar arithmetic is what makes a 500 Hz tick cheap.
        """
        (vx, vy, w), (sx, sy, turn), decay = self._shift(x, u, dt)
        px, py, heading, _, _, _, dx, dy, dw, bg, bax, bay, gx, gy = x
        middle = heading + 0.5 * turn
        c, s = math.cos(middle), math.sin(middle)
        px, py, heading = px + c * sx - s * sy, py + s * sx + c * sy, heading + turn
        dx, dy, dw = dx * decay, dy * decay, dw * decay
        return [px, py, heading, vx, vy, w, dx, dy, dw, bg, bax, bay, gx, gy]

    def advance_with_jacobian(self, x: Floats, u: Floats, dt: float) -> tuple[list[float], Array]:
        """State after ``dt``, see `advance`, and its derivative in the state, (14, 14)."""
        free = tuple(abs(u[i] - x[3 + i]) <= self._reach[i] for i in (0, 1, 2))
        known = self._axes.get((dt, free))
        if known is None:
            known = self._axes_for(dt, free)
        f0, (mxv, mxd), (myv, myd), (mwv, mwd) = known
        velocity, (sx, sy, turn), decay = self._shift(x, u, dt)
        middle = x[2] + 0.5 * turn
        c, s = math.cos(middle), math.sin(middle)
        dx, dy = c * sx - s * sy, s * sx + c * sy
        hx, hy = -0.5 * dy, 0.5 * dx  # d(x, y) by d(turn)
        f = f0.copy()
        f[:2, 2:9] = (
            (-dy, c * mxv, -s * myv, hx * mwv, c * mxd, -s * myd, hx * mwd),
            (dx, s * mxv, c * myv, hy * mwv, s * mxd, c * myd, hy * mwd),
        )
        after = [x[0] + dx, x[1] + dy, x[2] + turn, *velocity]
        after += [x[6] * decay, x[7] * decay, x[8] * decay, *x[9:]]
        return after, f

    def jacobian(self, x: Floats, u: Floats, dt: float) -> Array:
        """Derivative of `advance` in the state, (14, 14)."""
        return self.advance_with_jacobian(x, u, dt)[1]

    def _axes_for(self, dt: float, free: tuple[bool, ...]) -> _Axes:
        """The Jacobian but for the rows of x and y, and what displacement owes to v and d."""
        k = self._for(dt)
        f = np.eye(SIZE)
        moved = []
        for i, unlimited in enumerate(free):
            f[3 + i, 3 + i] = 1.0 - k.gone if unlimited else 1.0
            f[3 + i, 6 + i] = k.gained if unlimited else k.free_gained
            f[6 + i, 6 + i] = k.decay
            moved.append((k.lost, k.moved) if unlimited else (dt, k.free_moved))
        f[2, 5], f[2, 8] = moved[2]
        if len(self._axes) >= _KEPT:
            self._axes.clear()
        axes = self._axes[dt, free] = (f, moved[0], moved[1], moved[2])
        return axes

    def process_noise(self, heading: float, dt: float, scale: float = 1.0) -> Array:
        """Covariance (14, 14) that the random disturbance adds in ``dt``.

        White noise of intensity ``2 sigma^2 / T`` integrated three times (to disturbance, velocity,
        displacement), to leading order in ``dt``: good to some per cent for steps up to 20 ms.

        Args:
            heading: by which displacement is turned into O [rad].
            dt: duration [s]; taken to the next microsecond.
            scale: factor on the variance of the disturbance.
        """
        key = (round(dt, 6), scale)
        body = self._noises.get(key)
        if body is None:
            if len(self._noises) >= _KEPT:
                self._noises.clear()
            body = self._noises[key] = self._noise_in_B(*key)
        c, s = math.cos(heading), math.sin(heading)
        full, (x, y), (xv, yv), (xd, yd) = body
        q = full.copy()
        pose = (c * c * x + s * s * y, c * s * (x - y), c * s * (x - y), s * s * x + c * c * y)
        speed = (c * xv, -s * yv, s * xv, c * yv)
        push = (c * xd, -s * yd, s * xd, c * yd)
        q[_NOISE_ROWS, _NOISE_COLUMNS] = (*pose, *speed, *push, *speed, *push)
        return q

    def _noise_in_B(self, dt: float, scale: float) -> _Noise:
        """The same at heading zero, and of x, y: with itself, with its speed, its disturbance."""
        q = np.zeros((SIZE, SIZE))
        chain = np.array(
            (
                (dt**5 / 20.0, dt**4 / 8.0, dt**3 / 6.0),
                (dt**4 / 8.0, dt**3 / 3.0, dt**2 / 2.0),
                (dt**3 / 6.0, dt**2 / 2.0, dt),
            )
        )
        for i, sigma in enumerate(self.disturbance):
            axis = np.ix_((i, 3 + i, 6 + i), (i, 3 + i, 6 + i))
            q[axis] = chain * (2.0 * scale * sigma * sigma / self.correlation)
        q[9, 9] = self.gyro_bias_walk**2 * dt
        q[10, 10] = q[11, 11] = self.accel_bias_walk**2 * dt
        q[12, 12] = q[13, 13] = self.tilt_walk**2 * dt
        x, y, (xv, yv), (xd, yd) = q[0, 0], q[1, 1], (q[0, 3], q[1, 4]), (q[0, 6], q[1, 7])
        return q, (float(x), float(y)), (float(xv), float(yv)), (float(xd), float(yd))
