"""Writes recordings down in the plain form, as strangers would."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from observer.recordings.recording import Recording
from services.messages import Array

ODOMETRY = """
[odometry]
file = "odom.csv"
time = "t"
x = "x"
y = "y"
heading = "yaw"
"""
IMU = """
[imu]
file = "imu.csv"
time = "t"
gyro = ["gx", "gy", "gz"]
accel = ["ax", "ay", "az"]
"""
Columns = Mapping[str, Array]


def write_csv(path: Path, columns: Columns, delimiter: str = ",") -> None:
    """Write columns of equal length; nan becomes an empty cell."""
    lines = [delimiter.join(columns)]
    for row in zip(*columns.values(), strict=True):
        lines.append(delimiter.join("" if np.isnan(v) else f"{v:.9f}" for v in row))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def odometry_columns(recording: Recording) -> dict[str, Array]:
    """t, x, y, yaw."""
    o = recording.odometry
    assert o is not None
    return dict(zip(("t", "x", "y", "yaw"), [o.t.copy(), *o.values.T.copy()], strict=True))


def imu_columns(recording: Recording) -> dict[str, Array]:
    """t, gx .. gz, ax .. az."""
    i = recording.imu
    assert i is not None
    names = ("t", "gx", "gy", "gz", "ax", "ay", "az")
    return dict(zip(names, [i.t.copy(), *i.values.T.copy()], strict=True))


def write_log(
    folder: Path, odometry: Columns, imu: Columns | None = None, toml: str = ODOMETRY + IMU
) -> Path:
    """Write odom.csv, imu.csv and log.toml; the path of the last."""
    write_csv(folder / "odom.csv", odometry)
    if imu is not None:
        write_csv(folder / "imu.csv", imu)
    path = folder / "log.toml"
    path.write_text(toml, encoding="utf-8")
    return path


def edit_cell(path: Path, row: int, column: int, text: str) -> None:
    """Replace a cell; row 1 is the header, column 0 the first."""
    lines = path.read_text(encoding="utf-8").splitlines()
    cells = lines[row - 1].split(",")
    cells[column] = text
    lines[row - 1] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def in_sensor(values: Array, axes: Sequence[tuple[int, float]]) -> Array:
    """Columns (n, 3) of B as a turned sensor reads them: of each axis, which and with what sign."""
    return np.stack([sign * values[:, k] for k, sign in axes], axis=1)
