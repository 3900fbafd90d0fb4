"""Where the arm takes the board to be: as it was told, and as it is seen to drift."""

from __future__ import annotations

import numpy as np

from deploy.task import BoardPose
from services.messages import BoardEstimate

OLD = 0.1
"""A drift told this long ago is not carried on further [s]."""


class BoardPlace:
    """X_OS at an instant. What is seen comes without steps, and with its velocity.

    Args:
        board: X_OS as believed before anything is seen.

    Attributes:
        R: R_OS, (3, 3).
        p: p_OS, (3,) [m].
        velocity: of S in O: x, y [m/s], yaw [rad/s], (3,).
    """

    def __init__(self, board: BoardPose) -> None:
        self._board = board
        self._seen: BoardEstimate | None = None
        self.R, self.p = board.rotation(), board.position()
        self.velocity = np.zeros(3)

    def see(self, seen: BoardEstimate | None) -> None:
        """Take in the newest of the observer, None if there is none."""
        self._seen = seen

    def follow(self, now: float) -> None:
        """Bring R, p and velocity to ``now`` [s]."""
        seen = self._seen
        if seen is None:
            return
        age = now - seen.t
        x, y, yaw = (seen.pose + seen.velocity * min(max(age, 0.0), OLD)).tolist()
        place = BoardPose.model_construct(x=x, y=y, z=self._board.z, yaw=yaw)
        self.R, self.p = place.rotation(), place.position()
        self.velocity = seen.velocity if age < OLD else np.zeros(3)
