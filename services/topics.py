"""The topic table: the only place that states a key, its type, owner, rate, age limit and QoS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from services import messages as m

M = TypeVar("M", bound=m.Message)

SERVICES = ("sim", "observer", "arm", "base")
"""The processes that are the robot's system, in the order in which they start.

The base is last: nothing drives before the arm holds itself.
"""
ROBOT_PROCESS = "sim"
"""The process that is the robot: what it owns carries robot time."""
RECORDER = "recorder"
"""The process that only listens."""
PROCESSES = (RECORDER, *SERVICES)
CONSOLE = "console"
"""The process of the page: it hears what there is, and asks as people do."""


@dataclass(frozen=True)
class Topic(Generic[M]):
    """One row of the table.

    Attributes:
        name: key below the robot's name, for example ``robot/imu``.
        type: message class.
        owner: the only service that may publish it.
        rate: nominal rate [Hz].
        age_limit: a message older than this is not to be acted upon [s].
        control: part of a control loop: dropped rather than queued, sent at once, highest priority.
        depth: how many unread messages a reader keeps; 1 is latest-value.
        light_rate: rate at which a light log keeps it [Hz]; 0 keeps all, as a full log does.
        readers: the services that may hear it where access is controlled; recorder and people
            hear everything.
    """

    name: str
    type: type[M]
    owner: str
    rate: float
    age_limit: float
    control: bool = False
    depth: int = 1
    light_rate: float = 0.0
    readers: tuple[str, ...] = ()


# fmt: off
ARM_STATE = Topic(
    "robot/arm_state", m.ArmState, "sim", 1000, 0.05, control=True, light_rate=20,
    readers=("arm", "observer"),
)
HAND_STATE = Topic(
    "robot/hand_state", m.HandState, "sim", 500, 0.05, control=True, light_rate=20,
    readers=("arm",),
)
CLOCK = Topic(
    "robot/clock", m.Clock, "sim", 200, 0.5, control=True, light_rate=5,
    readers=("observer", "arm", "base"),
)
ODOMETRY = Topic(
    "robot/odometry", m.Odometry, "sim", 20, 0.5, control=True, depth=64, readers=("observer",)
)
IMU = Topic("robot/imu", m.Imu, "sim", 100, 0.1, control=True, depth=256, readers=("observer",))
SCAN = Topic("robot/scan", m.Scan, "sim", 10, 0.3, depth=4, light_rate=5, readers=("base",))
BUMPER = Topic("robot/bumper", m.Bumper, "sim", 50, 0.2, readers=("base",))
VISION = Topic(
    "robot/vision", m.Vision, "sim", 30, 0.5, depth=16, light_rate=10,
    readers=("observer", "base"),
)
ARM_COMMAND = Topic(
    "arm/command", m.ArmCommand, "arm", 1000, 0.05, control=True, light_rate=20, readers=("sim",)
)
HAND_COMMAND = Topic(
    "arm/hand_command", m.HandCommand, "arm", 500, 0.05, control=True, light_rate=20,
    readers=("sim",),
)
BASE_COMMAND = Topic(
    "base/command", m.BaseCommand, "base", 20, 0.1, control=True, depth=8,
    readers=("sim", "observer"),
)
ESTIMATE = Topic(
    "observer/estimate", m.Estimate, "observer", 500, 0.05, control=True, light_rate=20,
    readers=("arm", "base"),
)
BOARD = Topic(
    "observer/board", m.BoardEstimate, "observer", 50, 0.5, light_rate=10, readers=("arm",)
)
OBJECT = Topic(
    "observer/object", m.ObjectEstimate, "observer", 125, 0.5, light_rate=10, readers=("arm",)
)
ARM_STATUS = Topic("arm/status", m.ArmStatus, "arm", 50, 0.5, readers=("base",))
BASE_STATUS = Topic("base/status", m.BaseStatus, "base", 20, 0.5)
TRUTH = Topic("sim/truth", m.Truth, "sim", 200, 0.5, light_rate=25)
SIM_TICK = Topic(
    "sim/tick", m.Tick, "sim", 1000, 1e9, depth=8, readers=("observer", "arm", "base")
)
REQUEST = {s: Topic(f"{s}/request", m.Request, s, 1, 1e9, depth=64) for s in SERVICES}
HEALTH = {s: Topic(f"{s}/health", m.Health, s, 5, 1.5) for s in (*PROCESSES, CONSOLE)}
TICK = {
    s: Topic(f"{s}/tick", m.Tick, s, 1000, 1e9, depth=8, readers=SERVICES)
    for s in SERVICES if s != ROBOT_PROCESS
}
# fmt: on

_ALL: tuple[Topic[Any], ...] = (
    ARM_STATE,
    HAND_STATE,
    CLOCK,
    ODOMETRY,
    IMU,
    SCAN,
    BUMPER,
    VISION,
    ARM_COMMAND,
    HAND_COMMAND,
    BASE_COMMAND,
    ESTIMATE,
    BOARD,
    OBJECT,
    ARM_STATUS,
    BASE_STATUS,
    TRUTH,
    SIM_TICK,
    *REQUEST.values(),
    *HEALTH.values(),
    *TICK.values(),
)
TOPICS: dict[str, Topic[Any]] = {topic.name: topic for topic in _ALL}


def key(robot: str, topic: Topic) -> str:
    """Zenoh key expression of a topic of a robot."""
    return f"{robot}/{topic.name}"


def request_key(robot: str, service: str, verb: str) -> str:
    """Zenoh key expression of a request to a service."""
    return f"{robot}/request/{service}/{verb}"
