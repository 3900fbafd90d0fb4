"""What an arm with a pen does that no program has: keep its place or its joints, or come back."""

from __future__ import annotations

from arm.nodes import Context
from arm.recovery import AWAY, Retreat, Return, Station

NEAR = 0.03
"""An arm at rest nearer to the board than this keeps its place over it [m]."""
LEAVING = 0.03
"""Left of the arm's reach when an arm that only keeps its place lets go of it [m] ..."""
LEAVING_JOINT = 0.1
"""... and of a joint's range once it has come to rest [rad]."""


class AtRest:
    """Chooses among the motions of ``recovery``.

    Attributes:
        motion: the one in control while no program is; None before the first.
    """

    def __init__(self) -> None:
        self.motion: Retreat | Return | Station | None = None
        self._new = False
        self._lost = False

    def take(self, motion: Retreat | Return | Station) -> None:
        """Put a motion in control, from the next ``begin`` on."""
        self.motion = motion
        self._new = True

    def let_go(self, touching: bool, keep_place: bool) -> None:
        """Back off from what the tool touches, then keep its place or hold the joints."""
        distance = AWAY if touching else 0.0
        self.take(Station(distance) if keep_place else Retreat(distance))

    def lose_place(self) -> None:
        """There is nothing to keep a place by, for now: hold the joints instead."""
        if isinstance(self.motion, Station):
            self.take(Retreat(0.0))
            self._lost = True

    def find_place(self, resting: bool) -> None:
        """There is again; an arm that still rests keeps its place as before."""
        if self._lost and resting and isinstance(self.motion, Retreat):
            self.take(Station(0.0))
        self._lost = False

    def mind_the_board(self, context: Context, held: bool, left: float) -> None:
        """An arm at rest comes along with the platform, but not into the board.

        Args:
            context: of this tick.
            held: its joints are held, but a place could be.
            left: of the joints' range once they have come to rest [rad].
        """
        keeps = isinstance(self.motion, Station)
        if not keeps and not (held and context.tip[2] < NEAR):
            return
        can = context.reach_margin > LEAVING and left > LEAVING_JOINT
        if keeps and not can:
            self.take(Retreat(0.0))
        elif can and not keeps:
            self.take(Station(0.0))

    def begin(self, context: Context) -> bool:
        """Enter a motion that has just been put in control; returns whether there was one."""
        if not self._new or self.motion is None:
            return False
        self._new = False
        self.motion.enter(context)
        return True
