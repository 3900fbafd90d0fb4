"""What a service takes in: messages in order, of an age and a time that can be, each once."""

from __future__ import annotations

from services.messages import BadMessage, Message
from services.topics import CLOCK, ROBOT_PROCESS, Topic
from services.wire.codec import decode

PATIENCE = 0.5  # [s]; beyond its age limit a message is taken as a backlog and refused
JUMP = 60.0  # [s]; a restarted robot is not further ahead than this
FUTURE = 0.5  # [s]; a message this far ahead of us is not from our robot's time


class Admission:
    """Judges the messages of one topic as they arrive at one service.

    Attributes:
        seq: number of the newest that was accepted, -1 before the first.
        t: its instant [s].
        gap: how many numbers were missing before it, where a topic is read in full.
    """

    def __init__(self, topic: Topic) -> None:
        self.topic = topic
        self.seq = -1
        self.t = -1.0
        self.gap = 0
        self._accepted_at = -float("inf")

    def accept(
        self, payload: bytes, now: float | None, local: float, ordered: bool = True
    ) -> Message:
        """The message of a payload.

        Args:
            payload: as it came.
            now: robot time [s]; None as long as it is not known: no age is judged then.
            local: local time of the reader [s].
            ordered: judge order and age; False where nothing can be lost.

        Raises:
            BadMessage: it must not be used; the reason is one of ``codec.decode`` or ``admit``.
        """
        seq, message = decode(self.topic, payload)
        return self.admit(seq, message, now, local, ordered)

    def admit(
        self, seq: int, message: Message, now: float | None, local: float, ordered: bool = True
    ) -> Message:
        """The message, if it may be used after those before it.

        Raises:
            BadMessage: with reason ``old``, ``future``, ``duplicate`` or ``stale``.
        """
        if ordered:
            self._check_order(seq, message, now, local)
        missing = seq - 1 - self.seq
        self.gap = missing if self.topic.depth > 1 and self.seq >= 0 and missing < 10_000 else 0
        self.seq, self.t, self._accepted_at = seq, message.t, local
        return message

    def _check_order(self, seq: int, message: Message, now: float | None, local: float) -> None:
        topic = self.topic
        if topic is CLOCK:
            now = None  # it says what our time is: not to be judged by what we think it is
        silent = local - self._accepted_at > topic.age_limit
        if now is not None and now - message.t > topic.age_limit + PATIENCE:
            raise BadMessage("old", f"{now - message.t:.3f} s")
        # only the robot itself may jump ahead: restarted, it tells a time of its own
        ahead = JUMP if silent and topic.owner == ROBOT_PROCESS else FUTURE
        if now is not None and message.t - now > ahead:
            raise BadMessage("future", f"{message.t - now:.3f} s")
        if silent:  # nothing to compare with: the owner is new, or was restarted
            return
        if seq == self.seq:
            raise BadMessage("duplicate", str(seq))
        if topic.depth == 1 and message.t <= self.t:
            raise BadMessage("stale", f"{message.t} after {self.t}")
        if topic.depth > 1 and seq < self.seq:
            raise BadMessage("stale", f"number {seq} after {self.seq}")
