"""The executive of an arm with a hand as a service."""

from __future__ import annotations

from arm.hand.executive import HandExecutive
from arm.hand.nodes import REGISTRY
from deploy.task import BottleTask
from services.program_service import ProgramService
from services.service import Arrivals, Inbox, Outbox
from services.topics import ARM_STATE, ESTIMATE, HAND_COMMAND, HAND_STATE, Topic
from sim.scenario import Scenario

APART = 0.01
"""States of arm and hand further apart than this are not answered [s]."""


class HandService(ProgramService[HandExecutive]):
    """The executive of an arm with a hand; answers arm and hand together."""

    inputs: tuple[Topic, ...] = (ARM_STATE, HAND_STATE, ESTIMATE)

    def __init__(self, scenario: Scenario, live: bool, restarted: bool, seed: int = 0) -> None:
        task = scenario.task.bottle or BottleTask()
        executive = HandExecutive(scenario.robot, task, seed)
        self.period = executive.hand.model.robot.period
        self.driven_by = Arrivals(ARM_STATE, self.period)
        super().__init__(executive, REGISTRY, 7, 0, scenario, live, restarted)

    def step(self, now: float, inbox: Inbox) -> Outbox:
        """Answer the newest states of arm and hand, once."""
        arm, hand = inbox.latest(ARM_STATE), inbox.latest(HAND_STATE)
        if arm is None or hand is None or abs(arm.t - hand.t) > APART or not hand.of(4, 3):
            return []
        out = super().step(now, inbox)
        return [*out, (HAND_COMMAND, self.executive.hand_command)] if out else []

    def _look(self, inbox: Inbox) -> None:
        hand = inbox.latest(HAND_STATE)
        assert hand is not None
        self.executive.see_hand(hand)
