"""One service as the supervisor sees it, and when it is taken to hang."""

from __future__ import annotations

from dataclasses import dataclass, field

from arm.hds.machine import Machine
from services.live.plan import Plan
from services.live.stillness import Stillness
from services.topics import CONSOLE, RECORDER


@dataclass
class Watched:
    """What is known of a service that is started here; times are local and monotonic [s].

    Attributes:
        states: ``service_states.hds``.
        pid: of its process; 0 without one.
        progress: newest of its heartbeats.
        advanced: when that last grew.
        started: when its process was.
        lost: when its predecessor died or hung.
        failures: in a row.
        restarts: in all.
        due: when it is to be started again.
        was_ready: whether it ever was.
        stillness: of its loop.
    """

    states: Machine
    pid: int = 0
    progress: int = -1
    advanced: float = 0.0
    started: float = 0.0
    lost: float = 0.0
    failures: int = 0
    restarts: int = 0
    due: float = 0.0
    was_ready: bool = False
    stillness: Stillness = field(default_factory=Stillness)

    @property
    def ready(self) -> bool:
        """Whether it was heard since it was started."""
        return self.states.state == "ready"

    def hangs(self, name: str, plan: Plan, pulse: bool, now: float) -> str:
        """Why it is taken to hang; empty if it is not.

        Args:
            name: of the service.
            plan: that says how long is too long.
            pulse: whether there was one since the last look.
            now: local monotonic time [s].
        """
        beside = name in (RECORDER, CONSOLE)
        silent = max(plan.hang, plan.recorder_silent if beside else plan.silent)
        limit = silent if self.ready else plan.start
        if now - self.advanced > limit:
            return f"no progress for {limit:.1f} s"
        if beside or plan.mode != "live":
            return ""
        if pulse or not self.ready:
            self.stillness.went_round(now)
        elif self.stillness.watch(self.pid, now) > plan.hang:
            return f"its loop stood still for {plan.hang:.1f} s that were its own"
        return ""
