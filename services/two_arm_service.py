"""The executive of two arms as a service."""

from __future__ import annotations

from arm.grasping.executive import GraspExecutive
from arm.grasping.nodes import REGISTRY
from deploy.robot import TwoArmRobot, load_robot
from deploy.task import BoxTask
from services.program_service import ProgramService
from services.service import Arrivals, Inbox
from services.topics import ARM_STATE, ESTIMATE, OBJECT, Topic
from sim.scenario import Scenario


class TwoArmService(ProgramService[GraspExecutive]):
    """The executive of two arms."""

    inputs: tuple[Topic, ...] = (ARM_STATE, ESTIMATE, OBJECT)

    def __init__(self, scenario: Scenario, live: bool, restarted: bool) -> None:
        box = scenario.task.box or BoxTask()
        executive = GraspExecutive(scenario.robot, box.size)
        super().__init__(executive, REGISTRY, 14, 2, scenario, live, restarted)
        self.driven_by = Arrivals(ARM_STATE, load_robot(scenario.robot, TwoArmRobot).period)

    def _look(self, inbox: Inbox) -> None:
        self.executive.see_box(inbox.latest(OBJECT))
