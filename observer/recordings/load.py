"""Reads a log in the plain form: one TOML that describes CSV files (docs/logs.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from deploy.tomlfile import load_toml
from observer.recordings.assumptions import assumed_base, auto_keys
from observer.recordings.checks import check_together
from observer.recordings.description import (
    ImuColumns,
    LogDescription,
    PoseColumns,
    ReferenceColumns,
    Stamped,
    VelocityColumns,
)
from observer.recordings.frames import GRAVITY, east_north, heading_of
from observer.recordings.log import Log
from observer.recordings.problems import Problems
from observer.recordings.recording import Samples
from observer.recordings.series import Mask
from observer.recordings.stamps import UNITS, Timed, in_order, infer_unit, timed
from observer.recordings.table import BadTable, Rows, Table, numbers
from services.messages import Array

LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
ANGLES = {"rad": 1.0, "deg": np.pi / 180.0}
FORCES = {"m/s^2": 1.0, "g": GRAVITY, "mg": GRAVITY / 1000.0}
FEWEST = 10
"""Samples below which a sensor is no use."""
UNIT = 0.02
"""A quaternion may be this far from length one."""
FAR_AWAY = 1e5
"""Odometry beyond this [m] is moved to start at the origin: a map's grid, not wheels."""
RANGES = {"speeds": (50.0, 50.0), "commands": (50.0, 50.0), "imu": (50.0, 500.0)}
"""What no robot means: [m/s], [rad/s] of speeds and commands; [rad/s], [m/s^2] of the IMU."""


def load_recording(path: Path) -> Log:
    """Read the log that a description names.

    Args:
        path: the TOML; files it names lie beside it.

    Returns:
        The log; t = 0 at the earliest sample, the IMU still in its own axes.

    Raises:
        BadFile: a wrong description, or data that cannot be used: every finding with file, row
            and reason.
    """
    description = load_toml(path, LogDescription)
    problems = Problems(path)
    tables: dict[str, Table | None] = {}
    sensors = {
        name: read
        for name, stamped in description.sensors().items()
        if (read := _read(_Sensor(name, stamped), path.parent, tables, problems)) is not None
    }
    problems.raise_if_any()
    origin = min(float(s.t[0]) for s in sensors.values())
    samples = {
        name: Samples(s.t - origin, s.arrival - origin, s.values) for name, s in sensors.items()
    }
    base = assumed_base(description, samples)
    reference = description.reference
    log = Log(
        name=description.name or path.stem,
        base=base,
        odometry=samples.get("odometry"),
        speeds=samples.get("speeds"),
        imu=samples.get("imu"),
        commands=samples.get("commands"),
        reference=samples.get("reference"),
        reference_sigma=reference.sigma if reference is not None else 0.0,
        auto=auto_keys(description),
    )
    check_together(log, description, problems)
    problems.raise_if_any()
    return replace(log, findings=tuple(problems.notes))


@dataclass(frozen=True)
class _Sensor:
    """A described sensor."""

    name: str
    table: Stamped

    @property
    def columns(self) -> list[str]:
        """Columns of its values, in the order in which `_values` takes them."""
        d = self.table
        if isinstance(d, ImuColumns):
            return [*d.gyro, *d.accel]
        if isinstance(d, VelocityColumns):
            return [d.vx, *([d.vy] if d.vy else []), d.w]
        assert isinstance(d, PoseColumns)
        if isinstance(d, ReferenceColumns) and d.latitude and d.longitude:
            place = [d.latitude, d.longitude]
        else:
            place = [d.x or "", d.y or ""]
        return [*place, *([d.heading] if d.heading else []), *(d.quaternion or ())]


def _read(
    sensor: _Sensor, folder: Path, tables: dict[str, Table | None], problems: Problems
) -> Timed | None:
    """Samples of a sensor, or None if it cannot be read; everything wrong is reported."""
    stamped = sensor.table
    if stamped.file is None or stamped.time is None:
        key = "file" if stamped.file is None else "time"
        problems.error(f"{sensor.name}: no {key}: give it here or at the top of the description")
        return None
    if stamped.file not in tables:
        tables[stamped.file] = _table(folder / stamped.file, problems)
    table = tables[stamped.file]
    if table is None:
        return None
    stamps = [stamped.time, *([stamped.receive] if stamped.receive else [])]
    missing = table.missing([*stamps, *sensor.columns])
    for text in missing:
        problems.error(text)
    if missing:
        return None
    where = f"{table.name}: {sensor.name}"
    rows = numbers(table, stamps, sensor.columns, where, problems)
    if len(rows.rows) < FEWEST:
        problems.error(f"{where}: {len(rows.rows)} samples; {FEWEST} are the least")
        return None
    of = len(rows.rows)
    unit = stamped.time_unit or infer_unit(rows.values[:, 0], sensor.name)
    if stamped.time_unit is None and unit != "s":
        problems.note("time-unit", f"{where}: stamps taken to be in {unit}")
    rows = in_order(rows, UNITS[unit], where, problems)
    if isinstance(stamped, PoseColumns) and stamped.quaternion is not None:
        rows = _unit_quaternions(rows, len(stamps) + 2, where, problems)
    rows = _in_range(rows, sensor, len(stamps), where, problems)
    read = timed(
        rows,
        received=stamped.receive is not None,
        latency=stamped.latency,
        second=UNITS[unit],
        delay=getattr(stamped, "delay", None) or 0.0,
        where=where,
        problems=problems,
    )
    if len(read.t) < FEWEST:
        problems.error(
            f"{where}: {len(read.t)} samples are left of {of}, the others were dropped;"
            f" {FEWEST} are the least"
        )
        return None
    return Timed(read.t, read.arrival, _values(sensor, read.values, where, problems))


def _table(path: Path, problems: Problems) -> Table | None:
    try:
        table = Table.read(path)
    except BadTable as bad:
        problems.error(str(bad))
        return None
    of = len(table.rows) + len(table.long)
    problems.dropped(table.name, "more cells than the header has", table.long, of)
    return table


def _values(sensor: _Sensor, raw: Array, where: str, problems: Problems) -> Array:
    """Values as `Recording` wants them, of columns as `_Sensor.columns` names them."""
    d = sensor.table
    if isinstance(d, ImuColumns):
        return raw * ([ANGLES[d.angle_unit]] * 3 + [FORCES[d.accel_unit]] * 3)
    if isinstance(d, VelocityColumns):
        out = np.zeros((len(raw), 3))
        out[:, : raw.shape[1] - 1] = raw[:, :-1] * LENGTHS[d.length_unit]
        out[:, 2] = raw[:, -1] * ANGLES[d.angle_unit]
        return out
    assert isinstance(d, PoseColumns)
    if isinstance(d, ReferenceColumns) and d.latitude:
        place = east_north(raw[:, 0], raw[:, 1])
    else:
        place = raw[:, :2] * LENGTHS[d.length_unit]
        if np.max(np.abs(place)) > FAR_AWAY:
            x, y = place[0]
            problems.note("far-away", f"{where}: {x:.0f}, {y:.0f} m became the origin")
            place = place - place[0]
    if d.heading:
        heading = raw[:, 2] * ANGLES[d.angle_unit]
    elif d.quaternion is not None:
        q = np.zeros((len(raw), 4))
        q[:, -len(d.quaternion) :] = raw[:, 2:]
        heading = heading_of(q / np.linalg.norm(q, axis=1, keepdims=True))
    else:
        return place
    return np.column_stack([place, np.unwrap(heading)])


def _unit_quaternions(rows: Rows, first: int, where: str, problems: Problems) -> Rows:
    """The rows whose quaternion has length one; an error if it turns about another axis."""
    q = rows.values[:, first:]
    good = np.abs(np.linalg.norm(q, axis=1) - 1.0) <= UNIT
    why = "quaternion is not of length one"
    problems.dropped(where, why, rows.rows[~good].tolist(), len(good))
    if q.shape[1] == 4 and good.any():
        across = float(np.median(np.hypot(q[good, 0], q[good, 1])))
        if across > 0.5:
            problems.error(
                f"{where}: quaternion does not turn about the vertical (its x and y are"
                f" {across:.2f}): the order is qx, qy, qz, qw"
            )
    return rows.keep(good)


def _in_range(rows: Rows, sensor: _Sensor, first: int, where: str, problems: Problems) -> Rows:
    """The rows whose values a robot can have."""
    d = sensor.table
    v = np.abs(rows.values[:, first:])
    limits: list[tuple[str, Mask]] = []
    if isinstance(d, ImuColumns):
        turn, force = RANGES["imu"]
        wild = np.any(v[:, :3] * ANGLES[d.angle_unit] > turn, axis=1)
        hard = np.any(v[:, 3:] * FORCES[d.accel_unit] > force, axis=1)
        limits.append((f"gyro beyond {turn:g} rad/s", wild))
        limits.append((f"accelerometer beyond {force:g} m/s^2", hard))
    elif isinstance(d, VelocityColumns):
        fast, turn = RANGES[sensor.name]
        far = np.any(v[:, :-1] * LENGTHS[d.length_unit] > fast, axis=1)
        limits.append((f"beyond {fast:g} m/s", far))
        limits.append((f"beyond {turn:g} rad/s", v[:, -1] * ANGLES[d.angle_unit] > turn))
    good = np.ones(len(v), dtype=bool)
    for why, beyond in limits:
        problems.dropped(where, why, rows.rows[beyond].tolist(), len(v))
        good &= ~beyond
    return rows.keep(good)
