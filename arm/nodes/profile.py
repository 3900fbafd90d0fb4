"""A smooth run along a path: rest to cruise to rest, with bounded acceleration and jerk."""

from __future__ import annotations

from typing import Protocol


class TimeLaw(Protocol):
    """Arc length over time, from rest to rest."""

    @property
    def done(self) -> bool:
        """Whether the end has been reached."""
        ...

    def step(self, dt: float) -> tuple[float, float]:
        """Advance by ``dt`` [s]; returns arc length [m] and speed [m/s]."""
        ...


class Profile:
    """Arc length over time; the ramps follow a smoothstep of speed.

    Args:
        length: [m].
        speed: of the cruise [m/s]; a short path never gets there.
        acceleration: peak of the ramps [m/s^2].

    Raises:
        ValueError: speed or acceleration not positive.
    """

    def __init__(self, length: float, speed: float, acceleration: float) -> None:
        if speed <= 0 or acceleration <= 0:
            raise ValueError(f"speed {speed} and acceleration {acceleration} must be positive")
        self.length = max(length, 0.0)
        # a smoothstep ramp of duration T covers speed * T / 2 and peaks at 1.5 * speed / T
        speed = min(speed, (self.length * acceleration / 1.5) ** 0.5) if self.length > 0 else 0.0
        self._speed = speed
        self._ramp = 1.5 * speed / acceleration
        self._cruise = (self.length / speed - self._ramp) if speed > 0 else 0.0
        self._t = 0.0

    @property
    def duration(self) -> float:
        """Time from rest to rest [s]."""
        return 2.0 * self._ramp + self._cruise

    @property
    def done(self) -> bool:
        """Whether the end has been reached."""
        return self._t >= self.duration

    def step(self, dt: float) -> tuple[float, float]:
        """Advance by ``dt`` [s]; returns arc length [m] and speed [m/s]."""
        self._t = min(self._t + dt, self.duration)
        t, v, ramp = self._t, self._speed, self._ramp
        if ramp <= 0.0:
            return self.length, 0.0
        if t < ramp:
            return _ramp(t / ramp, v, ramp)
        if t <= ramp + self._cruise:
            return v * (t - 0.5 * ramp), v
        left, speed = _ramp((self.duration - t) / ramp, v, ramp)
        return self.length - left, speed


def _ramp(x: float, speed: float, ramp: float) -> tuple[float, float]:
    """Arc length and speed at fraction ``x`` of a ramp from rest."""
    return speed * ramp * x**3 * (1.0 - 0.5 * x), speed * x * x * (3.0 - 2.0 * x)
