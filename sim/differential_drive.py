"""A drive of two wheels: each keeps a speed, and grips ahead and across while the floor lets it.

What the command asks for is followed like by the other drive: first-order lag, within the limits
of acceleration. What a push adds is another matter: the wheels hold against it with all their
grip, and slide beyond.
"""

from __future__ import annotations

from collections.abc import Sequence

from services.messages import BaseCommand
from sim.drive import BRAKE_LAG, STANDSTILL, WATCHDOG, Drive, clamp

GRIP = (5.9, 5.9, 15.0)
"""What the wheels can do to the platform: ahead, across [m/s^2], turning [rad/s^2]; 0.6 g."""
SERVO = 0.03
"""Time constant with which the wheels return to their speed [s]."""
ACROSS = 0.002
"""Time constant with which wheels that cannot roll sideways stop what moves them so [s]."""
STANDS = (400.0, 400.0, 80.0)
"""What the wheels of a standing platform hold along x, y [N] and about the vertical [N m]."""


class DifferentialDrive(Drive):
    """Wheels with a speed of their own, which the platform follows as far as they grip."""

    _reference = (0.0, 0.0)

    def force(
        self, now: float, command: BaseCommand | None, velocity: Sequence[float]
    ) -> list[float]:
        """Force on the platform in B [N, N, N m]; vy of the command is not obeyed.

        Args:
            now: robot time [s].
            command: newest command, None before the first.
            velocity: V_WB_B [m/s, m/s, rad/s].
        """
        dt = self._dt
        silent = command is None or now - command.t > WATCHDOG
        asked = (0.0, 0.0) if silent or command is None else command.velocity.tolist()[::2]
        rough = self._roughness()
        vx, vy, w = velocity
        self.asked = any(asked)
        self.standing = max(abs(vx), abs(vy), abs(w)) < STANDSTILL and not self.asked
        if self.standing:
            self._reference = (0.0, 0.0)
            return [0.0, 0.0, 0.0]
        lag = max(BRAKE_LAG, dt) if silent else self._lag
        ahead, turn = (
            clamp((clamp(u, self._speed[i]) - r) / lag, self._acceleration[i])
            for i, u, r in zip((0, 2), asked, self._reference, strict=True)
        )
        r, s = self._reference
        self._reference = (r + ahead * dt, s + turn * dt)
        servo = max(SERVO, dt)
        wanted = (ahead + (r - vx) / servo, -vy / max(ACROSS, dt), turn + (s - w) / servo)
        held = [clamp(a, g) for a, g in zip(wanted, GRIP, strict=True)]
        held = [held[0] - w * vy, held[1] + w * vx, held[2]]  # B turns: v' = a - w x v
        return [m * (a + b) for m, a, b in zip(self._inertia, held, rough, strict=True)]
