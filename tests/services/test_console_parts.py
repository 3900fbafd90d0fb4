"""Parts of the console by themselves: the model, the forms, the clicks, the requests."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from patience import PATIENCE, until
from scipy.spatial.transform import Rotation

from services.console.asking import GAP, MOST, Asking
from services.console.controls import on_floor
from services.console.disturbances import options_of
from services.console.model import Model
from services.console.words import plain
from services.requests import NoAnswer
from services.service import Reply
from sim.disturbance import KINDS, disturbance_from
from sim.physics import Physics
from sim.scenario import World


def test_the_picture_is_where_the_physics_is() -> None:
    """Bodies stand where the simulation has them, for any pose and joint positions."""
    physics = Physics("xr4000_puma560", World(), np.random.default_rng(0))
    model = Model("xr4000_puma560")
    rng = np.random.default_rng(1)
    for _ in range(5):
        pose, q = rng.normal(size=3), rng.uniform(-1, 1, 6)
        positions = physics._skeleton.getPositions()
        positions[:3], positions[3:9] = pose, q
        physics._skeleton.setPositions(positions)
        for body, (wxyz, p) in model.place(pose, q).items():
            transform = physics._skeleton.getBodyNode(body).getTransform()
            if body == "pen":  # on its spring
                continue
            assert np.allclose(p, transform.translation(), atol=1e-9), body
            R = Rotation.from_quat(wxyz, scalar_first=True).as_matrix()
            assert np.allclose(R, transform.rotation(), atol=1e-9), body


@pytest.mark.parametrize("name", ["xr4000_puma560", "rmp_puma560", "rmp_two_arms"])
def test_every_robot_has_shapes_for_platform_and_arms(name: str) -> None:
    """All that the description draws is drawn, and nothing has no size."""
    model = Model(name)
    assert "platform" in model.bodies and len(model.bodies) >= 10
    assert {shape.body for shape in model.shapes} == set(model.bodies)
    assert all(min(shape.size) > 0 for shape in model.shapes)
    assert len(model.rest) in (6, 7, 14)


@pytest.mark.parametrize("kind", KINDS)
def test_a_form_as_it_stands_is_a_disturbance_that_is_accepted(kind: str) -> None:
    """So are both ends of every slider; each option of the schema has its control."""
    options = options_of(kind)
    assert {o.name for o in options} == set(KINDS[kind].model_fields) - {"kind", "t"}
    values: dict[str, Any] = {o.name: o.start for o in options if not o.optional}
    assert disturbance_from(kind, values, 1.0).t == 1.0
    for option in options:
        ends = option.choices or (option.low, option.high)
        for end in ends:
            disturbance_from(kind, {**values, option.name: end}, 1.0)


def test_a_click_meets_the_floor_or_nothing() -> None:
    """From 2 m up at 45 degrees: 2 m ahead. The sky is no goal."""
    down = np.array([1.0, 0.0, -1.0]) / np.sqrt(2)
    found = on_floor(np.array([1.0, 3.0, 2.0]), down)
    assert found is not None and np.allclose(found, [3.0, 3.0])
    assert on_floor(np.array([0.0, 0.0, 2.0]), np.array([1.0, 0.0, 0.1])) is None
    assert on_floor(np.array([0.0, 0.0, 2.0]), np.array([1.0, 0.0, -0.001])) is None


def test_every_press_has_an_answer() -> None:
    """Accepted, refused, nobody there: each with what to read."""

    def ask(service: str, verb: str, args: dict[str, Any]) -> Reply:
        if service == "base":
            raise NoAnswer("base of robot r1 does not answer")
        return Reply(verb == "start", "" if verb == "start" else "not now")

    asking = Asking(ask)
    assert asking("Start", "arm", "start").accepted
    assert asking("Reset", "arm", "reset").reason == "not now"
    gone = asking("Halt", "base", "stop")
    assert not gone.accepted and "does not answer" in gone.reason
    assert [a.label for a in asking.answers] == ["Start", "Reset", "Halt"]


def test_a_page_gone_wild_floods_nobody_and_the_stop_still_goes_through(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of many presses at once a few are sent; a stop is sent while all others wait."""
    sent, hold, now = [], threading.Event(), [0.0]
    clock = SimpleNamespace(monotonic=lambda: now[0])
    monkeypatch.setattr("services.console.asking.time", clock)

    def ask(service: str, verb: str, args: dict[str, Any]) -> Reply:
        sent.append(verb)
        if verb != "protective_stop":
            hold.wait(PATIENCE)
        return Reply(True)

    asking = Asking(ask)
    threads = [
        threading.Thread(target=asking, args=(f"control {i}", "sim", "disturb")) for i in range(50)
    ]
    for thread in threads:
        thread.start()
    until(
        lambda: sum(t.is_alive() for t in threads) == len(sent) == MOST,
        "a few that wait",
        lambda: f"{len(sent)} were sent" if len(sent) > MOST else "",
    )
    assert asking("Protective stop", "arm", "protective_stop", urgent=True).accepted
    hold.set()
    for thread in threads:
        thread.join(PATIENCE)
    assert sent.count("disturb") == MOST
    first, second = (asking("push", "sim", "disturb") for _ in range(2))
    assert first.accepted and not second.accepted
    now[0] += GAP
    assert asking("push", "sim", "disturb").accepted


def test_what_services_say_cannot_become_markup() -> None:
    """A reason is shown as it is written, whoever wrote it."""
    assert plain("<b>[x](y)`|*") == "\\<b\\>\\[x\\](y)\\`\\|\\*"
