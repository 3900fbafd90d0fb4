"""The arm's executive as a service."""

from __future__ import annotations

from dataclasses import replace

from arm.executive import Executive
from arm.hds import Program
from arm.nodes import REGISTRY
from arm.reachable import Reachability
from services.program_service import ProgramService
from services.service import Inbox
from services.topics import ARM_STATE, BOARD, ESTIMATE, Topic
from sim.scenario import Scenario


class ArmService(ProgramService[Executive]):
    """The arm's executive."""

    inputs: tuple[Topic, ...] = (ARM_STATE, ESTIMATE, BOARD)

    def __init__(self, scenario: Scenario, live: bool, restarted: bool, seed: int = 0) -> None:
        executive = Executive(scenario.robot, scenario.task.board)
        super().__init__(executive, REGISTRY, executive.model.joints, 1, scenario, live, restarted)
        if self._program is not None and scenario.task.shape_by_seed:
            self._program = shaped(self._program, seed + 1)
        self._reach = Reachability(scenario.robot, scenario.task.board)

    def _look(self, inbox: Inbox) -> None:
        self.executive.see_board(inbox.latest(BOARD))

    def _refuse(self, program: Program) -> None:
        """Raise ValueError if a node's points are out of reach; takes too long for the loop."""
        self._reach.refuse(program, self.executive.platform_pose)


def shaped(program: Program, shape: int) -> Program:
    """The same program, with parameter ``Shape`` of every node that has one set to ``shape``."""
    nodes = {
        name: replace(node, parameters={**node.parameters, "Shape": shape})
        if "Shape" in node.parameters
        else node
        for name, node in program.nodes.items()
    }
    return replace(program, nodes=nodes)
