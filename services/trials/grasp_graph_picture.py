"""The prepares graph of the grasp as it was sampled."""

from __future__ import annotations

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from arm.grasping.graph import GOAL, Graph, shortest
from services.reports.style import DRAWN, MEANT

PLACES = {
    "far_aside": (0, 2.0),
    "far_ahead": (0, 0.0),
    "aside": (1, 2.0),
    "front": (2, 0.0),
    "unstowed": (2, 2.0),
    "near": (3, 2.0),
    "astray": (4, 2.0),
    "touch": (5, 2.0),
    "approach": (3.4, 0.0),
    "reach": (4.6, 0.0),
    "contact": (5.6, 0.0),
    "comply": (6.7, 0.0),
    GOAL: (7.8, 0.0),
    "lost": (7, 2.0),
}
"""Where a state is drawn: the way to the goal along the bottom, what leads astray above."""
FAINT = 0.1
"""Ways that fewer of the runs took are left out [1]."""


def draw(graph: Graph) -> Figure:
    """States, the controllers that lead from one to another, and the search's ways to the goal."""
    figure, axis = plt.subplots(figsize=(11, 4.6), layout="constrained")
    chosen = {step for state in PLACES for step in shortest(graph, state) or []}
    drawn: dict[tuple[str, str], list[str]] = {}
    main: set[tuple[str, str]] = set()
    for (state, action), runs in graph.runs.items():
        if action not in graph.known(state):
            continue
        for after, p in graph.leads(state, action).items():
            if p < FAINT or after == state:
                continue
            drawn.setdefault((state, after), []).append(f"{action} {100 * p:.0f}%/{len(runs)}")
            if (state, action) in chosen and p >= 0.5:
                main.add((state, after))
    for i, ((state, after), words) in enumerate(sorted(drawn.items())):
        strong = (state, after) in main
        (x0, y0), (x1, y1) = PLACES[state], PLACES[after]
        bend = -0.2 if abs(y1 - y0) > 0.1 or abs(x1 - x0) < 1.3 else -0.35
        axis.annotate(
            "",
            (x1, y1),
            (x0, y0),
            arrowprops={
                "arrowstyle": "-|>",
                "color": DRAWN if strong else "0.7",
                "lw": 1.8 if strong else 0.7,
                "shrinkA": 17,
                "shrinkB": 17,
                "connectionstyle": f"arc3,rad={bend}",
            },
        )
        # beside the middle of the arc
        dx, dy = x1 - x0, y1 - y0
        middle = (x0 + x1) / 2 + bend * dy / 2, (y0 + y1) / 2 - bend * dx / 2 - 0.12 * (i % 2)
        look = {"fontsize": 7 if strong else 5, "color": DRAWN if strong else "0.5"}
        back = {"fc": "white", "ec": "none", "pad": 0.5}
        axis.text(*middle, "\n".join(words), ha="center", va="center", bbox=back, **look)
    for state, place in PLACES.items():
        style = {"boxstyle": "round", "fc": "white", "ec": MEANT if state == GOAL else "0.3"}
        axis.text(
            *place, state.replace("_", "\n"), ha="center", va="center", bbox=style, fontsize=8
        )
    axis.set_xlim(-0.5, 8.3)
    axis.set_ylim(-1.2, 2.8)
    axis.axis("off")
    return figure
