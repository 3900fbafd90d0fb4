"""Pictures of a run show what is known and nothing else, and can be read."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from deploy.task import BaseTask, BoardPose
from services.logs.runlog import RunLog
from services.messages import ArmCommand, ArmStatus, BoardEstimate, Truth
from services.reports.consistency import consistency_of
from services.reports.curves import broken, known
from services.reports.estimate_picture import estimate, from_board
from services.reports.evaluation import estimate_figures
from services.reports.faults import faults_of, lanes_of
from services.reports.force_picture import force, spread
from services.reports.platform_figures import platform_figures
from services.reports.sentences import timeline
from services.reports.torques_picture import torques
from services.run import run_lockstep
from services.topics import ARM_COMMAND, ARM_STATUS, ESTIMATE, TOPICS, TRUTH
from services.trials.grasp_pictures import overhead
from sim.scenario import load_scenario

FROM, TO = 1.0, 1.8
"""When nobody recorded the truth [s]."""


@pytest.fixture(scope="module")
def whole() -> RunLog:
    """Three seconds on a platform that sways."""
    return run_lockstep(load_scenario("whiteboard_moving"), 1, duration=3.0).log


@pytest.fixture(scope="module")
def holed(whole: RunLog) -> RunLog:
    """The same, but the simulation was gone for a while and came back a metre away.

    The estimate went on meanwhile, and is far off.
    """
    log = RunLog()
    for arrival, name, message in whole.merged():
        if name == TRUTH.name and FROM < message.t < TO:
            continue
        if name == TRUTH.name and message.t >= TO:
            message = replace(message, pose=message.pose + np.array([1.0, 0.0, 0.0]))
        if name == ESTIMATE.name and message.t > FROM:
            far = 1.0 if message.t >= TO - 1e-6 else 10.0
            message = replace(message, pose=message.pose + np.array([far, 0.0, 0.0]))
        log(TOPICS[name], message, arrival)
    return log


def test_known_is_what_lies_between_neighbours() -> None:
    """Samples themselves are known, what lies in a hole or outside is not."""
    ts = np.array([0.0, 0.05, 0.1, 0.5, 0.55])
    asked = np.array([-0.1, 0.0, 0.02, 0.1, 0.3, 0.5, 0.52, 0.55, 0.6])
    assert known(asked, ts).tolist() == [False, True, True, True, False, True, True, True, False]
    assert not known(asked, ts[:0]).any()
    t, values = broken(ts, np.column_stack([ts, ts]))
    assert np.isnan(t).tolist() == [False, False, False, True, False, False]
    assert np.isnan(values[3]).all() and np.array_equal(values[4], [0.5, 0.5])


def test_lines_break_where_the_truth_is_missing(holed: RunLog) -> None:
    """Neither truth nor error is drawn across the hole, not even as a straight line."""
    figure = estimate(holed, "")
    assert figure is not None
    for row in np.array(figure.axes).reshape(3, 2):
        for line in (row[0].lines[0], row[1].lines[0]):  # truth, error
            t, values = np.array(line.get_data(), float)
            drawn = np.isfinite(t) & np.isfinite(values)
            assert not ((t[drawn] > FROM + 1e-6) & (t[drawn] < TO - 1e-6)).any()
            together = [(a, b) for a, b in pairwise(range(len(t))) if drawn[a] and drawn[b]]
            assert max(t[b] - t[a] for a, b in together) < 0.1
    plt.close(figure)


def test_no_mean_is_taken_over_a_hole() -> None:
    """The pen was up before it and pressed after it: no force between the two is drawn."""
    log = RunLog()
    log(ARM_STATUS, ArmStatus(t=0.0, state="running"))
    zero = np.zeros(3)
    for k in range(400):
        t = 0.005 * k
        if not FROM < t < TO:
            samples = np.zeros((5, 4))
            samples[:, 3] = 0.0 if t <= FROM else 2.0
            log(TRUTH, Truth(t, zero, zero, zero, zero, zero, zero, 0.0, recent=samples))
    figure = force(log, "")
    assert figure is not None
    t, drawn = np.array(figure.axes[0].lines[0].get_data(), float)
    inside = np.isfinite(drawn) & (t > 0.1) & (t < 1.9)
    assert set(np.round(drawn[inside], 6)) == {0.0, 2.0}
    plt.close(figure)


def test_figures_do_not_judge_what_is_not_known(whole: RunLog, holed: RunLog) -> None:
    """An estimate in the hole has no truth to be compared with, and a jump in it is no way."""
    before, after = estimate_figures(whole), estimate_figures(holed)
    for key, value in after.items():
        assert value is not None and value < 1.5 * (before[key] or 0.0) + 1e-9, key
    assert all(f.error is None or f.error < 0.1 for f in faults_of(holed))
    assert consistency_of(holed).inside > 0.9
    task = BaseTask(behaviour="drive_to", goal=(1.0, 0.0, 0.0))
    ways = [platform_figures(log, task)["platform_way_m"] for log in (whole, holed)]
    assert ways[0] is not None and ways[1] is not None and ways[1] < ways[0]


def test_an_estimate_that_is_not_valid_is_not_drawn(whole: RunLog) -> None:
    """Before the first odometry it says zero, which would be a jump to where the platform is."""
    log = RunLog()
    for arrival, name, message in whole.merged():
        if name == ESTIMATE.name and message.t < 0.5:
            message = replace(message, valid=False, pose=np.array([9.0, 9.0, 9.0]))
        log(TOPICS[name], message, arrival)
    figure = estimate(log, "")
    assert figure is not None
    x = np.asarray(figure.axes[0].lines[1].get_ydata(), float)
    assert np.nanmax(np.abs(x)) < 1000.0  # [mm]
    plt.close(figure)


def test_seen_from_the_board_drift_is_no_error() -> None:
    """O that slid and turned against the world: the pose by the board is the true one."""
    board = BoardPose(x=0.7, y=0.1, z=1.0, yaw=-1.5)
    t = np.linspace(0.0, 1.0, 21)
    truth = np.column_stack([0.3 * t, 0.1 - 0.2 * t, 0.1 * t])
    slid, turned = np.array([0.02, -0.03]), 0.05
    c, s = np.cos(turned), np.sin(turned)
    R = np.array([[c, -s], [s, c]])
    believed = np.column_stack([truth[:, :2] @ R.T + slid, truth[:, 2] + turned])
    place = R @ [board.x, board.y] + slid
    pose, none = np.array([*place, board.yaw + turned]), (np.zeros(3), np.zeros((3, 3)))
    boards = [BoardEstimate(float(k), pose, *none) for k in t]
    assert np.allclose(from_board(t, believed, boards, board), truth, atol=1e-12)
    assert np.isnan(from_board(t + 5.0, believed, boards, board)).all()


def test_the_force_of_a_long_run_is_no_solid_block() -> None:
    """Two minutes with a lift of 1 ms each quarter of a second: the band stays narrow.

    Where the force is truly anywhere, the band says so.
    """
    rng = np.random.default_rng(1)
    t = 0.001 * np.arange(120_000)
    force = 1.5 + 0.02 * rng.standard_normal(len(t))
    force[::250] = 0.0
    wild = t > 60.0
    force[wild] = rng.uniform(0.0, 3.0, int(wild.sum()))
    at, low, high = spread(t, force)
    assert len(at) <= 1201
    wide = high - low
    assert wide[at < 59.9].max() < 0.2
    assert wide[at > 60.1].min() > 2.0


def test_names_of_nodes_can_be_read() -> None:
    """Above the joints, over their own stretch, none upon another, none that does not fit."""
    log = RunLog()
    starts = [("Start", 0.0), ("Approach1", 0.5), ("Dot", 0.52), ("Line1", 0.55), ("Retract1", 9.0)]
    for k in range(1001):
        t = 0.01 * k
        log(ARM_COMMAND, ArmCommand(t=t, tau=np.zeros(14)))
        node = [name for name, start in starts if start <= t + 1e-9][-1]
        log(ARM_STATUS, ArmStatus(t=t, state="running", node=node))
    figure = torques(log, "")
    assert figure is not None
    figure.draw_without_rendering()
    boxes = {x.get_text(): x.get_window_extent() for x in figure.axes[0].texts}
    assert set(boxes) == {"Start", "Line1", "Retract1"}
    placed = sorted(boxes.values(), key=lambda b: b.x0)
    assert all(a.x1 <= b.x0 for a, b in pairwise(placed))
    assert _upright_labels_apart(figure)
    plt.close(figure)


def _upright_labels_apart(figure: Figure) -> bool:
    """Whether the joints' names, one below the other, do not touch."""
    labels = [axis.yaxis.label.get_window_extent() for axis in figure.axes]
    return all(below.y1 <= above.y0 for above, below in pairwise(labels))


def test_ways_from_above_say_whose_they_are() -> None:
    """Each kind of line is in the legend once, however many trials are drawn."""
    way = [[0.0, 0.0], [1.0, 0.5]]
    paths = {"t": [[0.0], [1.0]], "base": way, "left_palm": way, "right_palm": way}
    figure = overhead([{"paths": paths, "start_s": 0.0}] * 3)
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert [w.split(",")[0] for w in words] == ["box", "middle of the platform", "palms"]
    plt.close(figure)


def test_a_hold_whose_reason_counts_on_is_one_stretch_and_said() -> None:
    """Its figures change at every status; the timeline and its sentence speak of one hold."""
    log = RunLog()
    log(ARM_STATUS, ArmStatus(t=0.0, state="running"))
    for k in range(1, 60):
        reason = f"the arm is {44 + k} ms behind the estimate"
        log(ARM_STATUS, ArmStatus(t=0.1 * k, state="safe_hold", reason=reason))
    log(ARM_STATUS, ArmStatus(t=6.0, state="running"))
    assert [s.what.partition(":")[0] for s in lanes_of(log).arm] == [
        "running",
        "safe_hold",
        "running",
    ]
    said = timeline(log, {})
    assert "The arm held for 5.9 s, first in safe_hold: the arm is 45 ms behind" in said
