"""Follow a path in time: feed the drive ahead of its lag, and correct what is left."""

from __future__ import annotations

import numpy as np

from base.behaviour import Senses, Vote
from base.paths import Path
from base.planar import compose, difference, rotate, shorten
from services.messages import Array

_H = 0.02  # half step of the central difference that gives the path's acceleration [s]
_PAUSE = 0.2  # between two votes, beyond which the path is taken up anew [s]


class FollowPath:
    """Feed-forward through the inverse of the drive's first-order lag, plus proportional feedback.

    Path time runs up from standing still over ``ramp``, so that no path starts with a step. When
    the platform has been stopped meanwhile, path time stood still and runs up again.

    Args:
        path: relative to its start.
        lag: of the drive's response to a command [s].
        ahead: how much later than ``now`` a command acts on average: dead time of the drive plus
            half the time between commands [s].
        origin: (3,) X_OB at the path's start; None is where the first vote finds the platform.
        gain: of the feedback [1/s].
        ramp: of path time, from standing still to running [s].
    """

    name = "follow_path"

    def __init__(
        self,
        path: Path,
        lag: float,
        ahead: float,
        origin: Array | None = None,
        gain: float = 1.0,
        ramp: float = 2.0,
    ) -> None:
        self._path, self._lag, self._ahead = path, lag, ahead
        self._origin = None if origin is None else np.array(origin, dtype=np.float64)
        self._gain, self._ramp = gain, ramp
        self._begin = 0.0  # robot time at which path time began to run up [s]
        self._before = 0.0  # path time reached until then [s]
        self._newest: float | None = None

    @property
    def state(self) -> str:
        """``following``, or ``finished`` at the path's end."""
        finished = self._newest is not None and self._time(self._newest)[0] >= self._path.duration
        return "finished" if finished else "following"

    def vote(self, now: float, senses: Senses) -> Vote:
        """V_OB_B that keeps the platform on the path."""
        estimate = senses.estimate
        if self._origin is None:
            self._origin = estimate.pose.copy()
        if self._newest is None or now - self._newest > _PAUSE:
            self._before = 0.0 if self._newest is None else self._time(self._newest)[0]
            self._begin = now
        self._newest = now

        heading = estimate.pose[2] + estimate.velocity[2] * (now - estimate.t)
        then = now + self._ahead
        # a heading error must not turn the path's velocity in the ground frame
        ahead = rotate(self.reference(now)[2] - heading, self._fed(then))
        error = difference(self.reference(estimate.t), estimate.pose)
        feedback = shorten(self._gain * error, translation=0.15, turn=0.3)
        return Vote(ahead + rotate(-heading, feedback))

    def ahead(self, times: list[float]) -> Array:
        """(n, 3) V_OB_B that it will feed ahead at robot times (n,), feedback apart."""
        return np.array([self._fed(t + self._ahead) for t in times])

    def _fed(self, then: float) -> Array:
        """(3,) through the inverse of the lag, along axes of the path's own pose."""
        wanted = self._body_velocity(then)
        rate = (self._body_velocity(then + _H) - self._body_velocity(then - _H)) / (2 * _H)
        return wanted + self._lag * rate

    def reference(self, t: float) -> Array:
        """(3,) X_OB of the path at robot time ``t`` [s]."""
        assert self._origin is not None
        return compose(self._origin, self._path.pose(self._time(t)[0]))

    def _body_velocity(self, t: float) -> Array:
        """(3,) velocity of the path in the frame of its own pose at robot time ``t`` [s]."""
        s, rate = self._time(t)
        return rotate(-self._path.pose(s)[2], rate * self._path.velocity(s))

    def _time(self, t: float) -> tuple[float, float]:
        """Path time [s] and its rate [1] at robot time ``t`` [s]."""
        u = (t - self._begin) / self._ramp
        if u <= 0:
            return self._before, 0.0
        if u >= 1:
            return self._before + self._ramp * (u - 0.5), 1.0
        return self._before + self._ramp * (u**3 - u**4 / 2), u * u * (3 - 2 * u)
