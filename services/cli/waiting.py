"""What a running system waits for, said to whoever watches ``steadyhand up``."""

from __future__ import annotations

import time
from collections.abc import Callable

from rich.text import Text

from services.live.plan import Plan
from services.live.supervisor import Event

NEEDS = {
    "safe_hold": "the arm has let go and waits; in another terminal: steadyhand program resume",
    "paused": "the arm is paused and waits; in another terminal: steadyhand program resume",
    "protective_stop": "look at the robot, then, in another terminal: steadyhand arm reset",
}
"""What a person has to do in a state of the arm; the states not named need nobody."""
RESTARTED = "it waits for a person; in another terminal: steadyhand program start"


class Waiting:
    """Follows the events of a run; rendered, it is one line on where the run stands.

    Args:
        plan: of the run.
        clock: local time [s].
    """

    def __init__(self, plan: Plan, clock: Callable[[], float] = time.monotonic) -> None:
        self._plan, self._clock = plan, clock
        self._begun = clock()
        self._last = self._needs = ""

    def hear(self, event: Event) -> str:
        """Take in an event; what it asks of people, with when the run ends anyhow, or nothing."""
        if event.service == "arm":
            self._needs = NEEDS.get(event.kind, "")
            if event.kind == "restarted":
                self._needs = RESTARTED
            if event.kind == "protective_stop" and self._plan.until_finished:
                self._needs = ""  # the run ends with it
        self._last = f"{event.service} {event.kind}".strip()
        return f"{self._needs}{self._end()}" if self._needs and event.service == "arm" else ""

    def _end(self) -> str:
        """When the run ends by itself; a paced one counts robot time."""
        if self._plan.duration is None:
            return ""
        left = self._plan.duration - (self._clock() - self._begun)
        return f"; otherwise it ends in {max(0.0, left):.0f} s"

    def __rich__(self) -> Text:
        passed = f"{self._clock() - self._begun:8.0f} s"
        if self._needs:
            return Text(f"{passed}  {self._needs}{self._end()}", "bold yellow")
        end = self._end().replace("; otherwise it", "; it")
        return Text(f"{passed}  {self._last}{end}; Ctrl-C ends it now", "dim")
