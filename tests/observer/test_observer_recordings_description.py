"""Reading the plain form: what is understood, what is dropped and said, what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from deploy.tomlfile import BadFile
from observer.recordings.load import load_recording
from observer.recordings.log import Log
from observer.recordings.problems import Problems
from observer.recordings.recording import Recording
from tests.observer.recordings_files import (
    IMU,
    ODOMETRY,
    edit_cell,
    imu_columns,
    odometry_columns,
    write_csv,
    write_log,
)
from tests.observer.recordings_motion import course, logged


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Half a minute of a random course."""
    return logged(course(1, 20.0), 1)


@pytest.fixture
def path(tmp_path: Path, recording: Recording) -> Path:
    """The same, written down without a fault."""
    return write_log(tmp_path, odometry_columns(recording), imu_columns(recording))


def said(log: Log) -> str:
    """Findings of a log that was read."""
    return "\n".join(str(v) for v in log.findings)


def refused(path: Path) -> str:
    """Findings of a log that was not."""
    with pytest.raises(BadFile) as caught:
        load_recording(path)
    return str(caught.value)


def test_what_was_written_is_read(path: Path, recording: Recording) -> None:
    """Stamps count from the first sample, values are SI, nothing is dropped, nothing is said."""
    log = load_recording(path)
    assert log.name == "log" and log.findings == ()
    assert log.odometry is not None and log.imu is not None
    assert log.odometry.t[0] == 0.0
    assert log.odometry.values == pytest.approx(recording.odometry.values, abs=1e-8)
    assert log.imu.values == pytest.approx(recording.imu.values, abs=1e-8)
    assert log.base.imu.rate == pytest.approx(100.0, rel=1e-3)
    assert {"odometry.delay", "imu.up", "platform.lag"} <= log.auto


def test_other_units_mean_the_same(tmp_path: Path, recording: Recording) -> None:
    """Milliseconds since 1970, millimetres, degrees, g: the same recording, the unit said."""
    o, i = odometry_columns(recording), imu_columns(recording)
    o = {
        "t": (o["t"] + 1.7e9) * 1e3,
        "x": o["x"] * 1e3,
        "y": o["y"] * 1e3,
        "yaw": np.degrees(o["yaw"]),
    }
    i = {k: v / 9.81 if k[0] == "a" else np.degrees(v) for k, v in i.items()}
    i["t"] = (np.radians(i["t"]) + 1.7e9) * 1e3
    units = 'length_unit = "mm"\nangle_unit = "deg"\n'
    toml = ODOMETRY + units + IMU + 'angle_unit = "deg"\naccel_unit = "g"\n'
    log = load_recording(write_log(tmp_path, o, i, toml))
    assert log.odometry is not None and log.imu is not None
    assert log.odometry.t == pytest.approx(recording.odometry.t - 0.1, abs=1e-5)
    assert log.odometry.values == pytest.approx(recording.odometry.values, abs=1e-7)
    assert log.imu.values == pytest.approx(recording.imu.values, abs=1e-6)
    assert "odom.csv: odometry: stamps taken to be in ms" in said(log)


@pytest.mark.parametrize(("unit", "second"), [("s", 1.0), ("us", 1e-6), ("ns", 1e-9)])
def test_the_unit_of_time_is_told_by_the_period(
    tmp_path: Path, recording: Recording, unit: str, second: float
) -> None:
    """Whatever stamps count in, the rate comes out right."""
    o = odometry_columns(recording)
    o["t"] = o["t"] / second
    log = load_recording(write_log(tmp_path, o, None, ODOMETRY))
    assert log.odometry is not None and log.odometry.period == pytest.approx(0.05, rel=1e-3)
    assert (f"in {unit}" in said(log)) == (unit != "s")


def test_one_file_with_empty_cells_holds_several_sensors(
    tmp_path: Path, recording: Recording
) -> None:
    """A row belongs to the sensor whose cells are filled; the others lose nothing and say so."""
    o, i = odometry_columns(recording), imu_columns(recording)
    t = np.concatenate([o["t"], i["t"]])
    order = np.argsort(t, kind="stable")
    columns = {"t": t[order]}
    for one, n_before, n_after in ((o, 0, len(i["t"])), (i, len(o["t"]), 0)):
        for name, values in list(one.items())[1:]:
            full = np.concatenate([np.full(n_before, np.nan), values, np.full(n_after, np.nan)])
            columns[name] = full[order]
    write_csv(tmp_path / "all.csv", columns, delimiter=";")
    toml = 'file = "all.csv"\ntime = "t"\n' + ODOMETRY.replace(
        'file = "odom.csv"\ntime = "t"\n', ""
    )
    toml += IMU.replace('file = "imu.csv"\ntime = "t"\n', "")
    path = tmp_path / "log.toml"
    path.write_text(toml)
    log = load_recording(path)
    assert log.odometry is not None and log.imu is not None and log.findings == ()
    assert log.odometry.values == pytest.approx(recording.odometry.values, abs=1e-8)
    assert len(log.imu) == len(recording.imu)


def test_heading_may_come_as_quaternion_and_columns_be_negated(
    tmp_path: Path, recording: Recording
) -> None:
    """qz, qw; qx, qy, qz, qw; a heading that counts clockwise with a minus before its column."""
    o = odometry_columns(recording)
    half = 0.5 * o.pop("yaw")
    o |= {"qx": 0 * half, "qy": 0 * half, "qz": np.sin(half), "qw": np.cos(half), "cw": -2 * half}
    for heading in (
        'quaternion = ["qz", "qw"]',
        'quaternion = ["qx", "qy", "qz", "qw"]',
        'heading = "-cw"',
    ):
        toml = ODOMETRY.replace('heading = "yaw"', heading)
        log = load_recording(write_log(tmp_path, o, None, toml))
        assert log.odometry is not None
        assert log.odometry.values[:, 2] == pytest.approx(recording.odometry.values[:, 2], abs=1e-7)


def test_latitude_and_longitude_become_metres(tmp_path: Path, recording: Recording) -> None:
    """A thousandth of a degree is 111 m north and, at 60 degrees north, 56 m east."""
    o = odometry_columns(recording)
    n = len(o["t"])
    o["lat"], o["lon"] = 60.0 + np.linspace(0, 1e-3, n), 11.0 + np.linspace(0, 1e-3, n)
    toml = ODOMETRY + (
        '[reference]\nfile = "odom.csv"\ntime = "t"\nlatitude = "lat"\nlongitude = "lon"\n'
        "sigma = 0.9\n"
    )
    log = load_recording(write_log(tmp_path, o, None, toml))
    assert log.reference is not None and log.reference_sigma == 0.9
    assert log.reference.values[-1] == pytest.approx([55.80, 111.41], abs=0.05)


def test_receive_column_and_known_delay(tmp_path: Path, recording: Recording) -> None:
    """Arrival is read; a known delay is taken off the stamps and not estimated again."""
    o = odometry_columns(recording)
    o["r"] = o["t"] + 0.03
    toml = ODOMETRY + 'receive = "r"\ndelay = 0.1\nresolution = [0.001, 0.001, 0.0017]\n'
    log = load_recording(write_log(tmp_path, o, None, toml))
    assert log.odometry is not None
    assert np.median(log.odometry.arrival - log.odometry.t) == pytest.approx(0.13, abs=1e-6)
    assert "odometry.delay" not in log.auto and log.base.odometry.resolution[2] == 0.0017


def test_a_handful_of_bad_rows_is_dropped_and_said(path: Path) -> None:
    """Words, nan, empty and missing cells: dropped, counted by reason, first row named."""
    odom = path.parent / "odom.csv"
    edit_cell(odom, 17, 3, "n/a")
    edit_cell(odom, 20, 3, "?")
    edit_cell(odom, 30, 1, "nan")
    edit_cell(odom, 40, 2, "")
    edit_cell(odom, 50, 3, "0.1,9,9")
    log = load_recording(path)
    text = said(log)
    assert "odom.csv: odometry: 2 rows dropped: column 'yaw' is not a number, as 'n/a'" in text
    assert "(first in row 17)" in text
    assert "1 row dropped: column 'x' is not finite (row 30)" in text
    assert "1 row dropped: column 'y' is empty (row 40)" in text
    assert "odom.csv: 1 row dropped: more cells than the header has (row 50)" in text


def test_stamps_that_repeat_or_go_back_are_dropped(path: Path, recording: Recording) -> None:
    """An equal stamp, one that is too early, one far ahead: only those rows go."""
    odom = path.parent / "odom.csv"
    edit_cell(odom, 100, 0, f"{recording.odometry.t[97]:.9f}")
    edit_cell(odom, 200, 0, "1.0")
    edit_cell(odom, 300, 0, "400.0")
    log = load_recording(path)
    assert log.odometry is not None and len(log.odometry) == len(recording.odometry) - 3
    assert "1 row dropped: stamp equal to the one before (row 100)" in said(log)
    assert "2 rows dropped: stamps go backwards or leap (first in row 200)" in said(log)


def test_a_clock_that_was_set_is_refused(path: Path, tmp_path: Path, recording: Recording) -> None:
    """Stamps that go back and stay there are two logs: the row is named."""
    o = odometry_columns(recording)
    o["t"][150:] -= 5.0
    write_csv(tmp_path / "odom.csv", o)
    assert (
        "odom.csv: odometry: stamps go back by 4.95 s at row 152 and go on from there:"
        " a clock that was set or two logs in one; split the file there"
    ) in refused(path)


def test_first_stamps_before_the_clock_was_set_are_dropped(
    tmp_path: Path, path: Path, recording: Recording
) -> None:
    """Two rows at zero before stamps since 1970 do not stretch the log over decades."""
    o = odometry_columns(recording)
    o["t"] += 1.7e9
    o["t"][:2] = 0.0, 0.05
    write_csv(tmp_path / "odom.csv", o)
    log = load_recording(write_log(tmp_path, o, None, ODOMETRY))
    assert log.odometry is not None and len(log.odometry) == len(recording.odometry) - 2
    assert "2 rows dropped: stamps of another time, 4.72e+05 h away" in said(log)


def test_too_many_bad_rows_are_refused(tmp_path: Path, recording: Recording) -> None:
    """More than a twentieth of the rows: the log is not used, and all reasons are given at once."""
    o, i = odometry_columns(recording), imu_columns(recording)
    o["x"][50:100], i["gz"][::10] = np.nan, np.nan
    text = refused(write_log(tmp_path, o, i))
    of = len(o["t"])
    assert (
        f"odometry: 50 of {of} rows cannot be used: column 'x' is empty (first in row 52)" in text
    )
    assert "imu.csv: imu: " in text and "column 'gz' is empty" in text


def test_missing_files_and_columns_are_named_with_the_nearest(path: Path) -> None:
    """Both findings at once, each with what was probably meant."""
    toml = path.read_text().replace('"yaw"', '"Yaw_"').replace("imu.csv", "imu2.csv")
    path.write_text(toml)
    text = refused(path)
    assert "odom.csv: no column 'Yaw_'; did you mean 'yaw'? Columns: t, x, y, yaw" in text
    assert "imu2.csv: no such file; did you mean 'imu.csv'?" in text


@pytest.mark.parametrize(
    ("toml", "finding"),
    [
        (ODOMETRY.replace("heading", "headign"), "odometry.headign: unknown key; did you mean"),
        (ODOMETRY + 'quaternion = ["a", "b"]\n', "give heading or quaternion, not both"),
        (ODOMETRY.replace('heading = "yaw"', ""), "give heading (a column) or quaternion"),
        (IMU, "needs [odometry] or [speeds]: without wheels there is no pose"),
        (ODOMETRY + IMU + 'up = "z"\n', "imu.up: "),
        (ODOMETRY + IMU + 'up = "+z"\nforward = "-z"\n', "are the same axis"),
        (ODOMETRY.replace('time = "t"', ""), "odometry: no time: give it here or at the top"),
        ("[odometry\n", "not TOML"),
    ],
)
def test_wrong_descriptions_are_refused(path: Path, toml: str, finding: str) -> None:
    """Every mistake in the TOML is named by its key or says what is missing."""
    path.write_text(toml)
    assert finding in refused(path)


@pytest.mark.parametrize(
    ("column", "factor", "finding"),
    [
        ("a", 1 / 9.81, "accelerometer reads 1 m/s^2 at most times, not 9.81: is it in g? accel_u"),
        ("a", 0.5, "not 9.81: wrong columns or unit"),
        ("gz", 180 / np.pi, "times as far as the gyro: is the gyro in degrees? [imu] angle_unit"),
        ("gz", -1.0, "one of them counts clockwise: put a minus before the name of its column"),
        ("gz", 0.2, "times as far as the gyro: wrong columns, axes or unit"),
    ],
)
def test_wrong_units_and_axes_of_the_imu_are_refused(
    path: Path, recording: Recording, column: str, factor: float, finding: str
) -> None:
    """Gravity and wheels show a wrong unit, axis or sign, and the message says what to write."""
    i = imu_columns(recording)
    for name in i:
        if name.startswith(column):
            i[name] = i[name] * factor
    write_csv(path.parent / "imu.csv", i)
    assert finding in refused(path)


def test_heading_in_degrees_is_refused(path: Path, recording: Recording) -> None:
    """With a gyro beside it as without."""
    o = odometry_columns(recording)
    o["yaw"] = np.degrees(o["yaw"])
    write_csv(path.parent / "odom.csv", o)
    assert 'is odometry in degrees? [odometry] angle_unit = "deg"' in refused(path)


def test_swapped_axes_are_refused(path: Path, recording: Recording) -> None:
    """Gravity that is not on the axis said to point up."""
    path.write_text(ODOMETRY + IMU + 'up = "+y"\n')
    assert 'imu: gravity is on +z, 90 deg from up = \'+y\': up = "+z" or "auto"' in refused(path)


def test_quaternions_in_another_order_are_refused(tmp_path: Path, recording: Recording) -> None:
    """w first is told by a turn about an axis that is not vertical; a length of two as well."""
    o = odometry_columns(recording)
    half = 0.5 * o["yaw"] + 0.8
    o |= {"w": np.cos(half), "a": 0 * half, "b": 0 * half, "z": np.sin(half), "z2": 2 * half}
    toml = ODOMETRY.replace('heading = "yaw"', 'quaternion = ["w", "a", "b", "z"]')
    text = refused(write_log(tmp_path, o, None, toml))
    assert "the order is qx, qy, qz, qw" in text
    toml = ODOMETRY.replace('heading = "yaw"', 'quaternion = ["z2", "w"]')
    assert "quaternion is not of length one" in refused(write_log(tmp_path, o, None, toml))


def test_clocks_that_do_not_meet_are_refused(path: Path, recording: Recording) -> None:
    """Sensors stamped by different clocks; arrival told by another clock is mended and said."""
    i = imu_columns(recording)
    i["t"] = i["t"] + 1.7e9
    write_csv(path.parent / "imu.csv", i)
    assert "odometry and imu do not overlap in time" in refused(path)
    o = odometry_columns(recording)
    o["r"] = o["t"] + 1.7e9 + 0.02
    o["r"][3] -= 0.015
    log = load_recording(write_log(path.parent, o, None, ODOMETRY + 'receive = "r"\n'))
    assert log.odometry is not None
    assert np.median(log.odometry.arrival - log.odometry.t) == pytest.approx(0.015, abs=1e-4)
    assert "s from the stamp: two clocks" in said(log)


def test_gravity_taken_out_needs_a_mounting(path: Path, recording: Recording) -> None:
    """Without gravity nobody can tell which way is up; said so, and accepted once it is given."""
    i = imu_columns(recording)
    i["az"] = i["az"] - 9.81
    write_csv(path.parent / "imu.csv", i)
    assert "gravity has been taken out, so say how it is mounted" in refused(path)
    path.write_text(path.read_text() + 'up = "+z"\n')
    assert "gravity has been taken out of the accelerometer" in said(load_recording(path))


def test_findings_beyond_twenty_are_counted() -> None:
    """A wholly wrong log is no flood; the same finding twice is one."""
    problems = Problems(Path("log.toml"))
    problems.raise_if_any()
    for k in range(25):
        problems.error(f"finding {k}")
        problems.error(f"finding {k}")
    with pytest.raises(BadFile) as caught:
        problems.raise_if_any()
    assert len(caught.value.findings) == 21 and caught.value.findings[-1] == "and 5 more"


# --- rows that vanish, quotes, names ----------------------------------------------------------


@pytest.mark.parametrize("sensor", ["odometry", "commands"])
def test_a_sensor_whose_rows_all_go_is_an_error(
    tmp_path: Path, recording: Recording, sensor: str
) -> None:
    """One row written over and over is one sample: refused by name, without a traceback."""
    o = odometry_columns(recording)
    same = {name: np.full(40, values[5]) for name, values in o.items()}
    toml = ODOMETRY
    if sensor == "commands":
        write_csv(tmp_path / "commands.csv", same)
        toml += '[commands]\nfile = "commands.csv"\ntime = "t"\nvx = "x"\nw = "yaw"\n'
    text = refused(write_log(tmp_path, same if sensor == "odometry" else o, None, toml))
    assert f"{sensor}: 1 samples are left of 40" in text


@pytest.mark.parametrize("cells", ['"1.0,2,3,4', '1.0,"2,3,4\n1.05,2",3,4', '"1"0,2,3,4'])
def test_an_open_quote_is_named_by_its_line(path: Path, cells: str) -> None:
    """Whether it runs to the end of the file or swallows a row or two."""
    file = path.parent / "odom.csv"
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines[:30], cells, *lines[30:]]) + "\n")
    text = refused(path)
    assert "odom.csv: line 31: " in text and "quote" in text


def test_only_a_column_that_is_asked_for_can_be_there_twice(
    tmp_path: Path, recording: Recording
) -> None:
    """Empty names are no names, and x twice is not vx twice; -x is x."""
    o = odometry_columns(recording)
    path = write_log(tmp_path, o, None, ODOMETRY)
    lines = (tmp_path / "odom.csv").read_text().splitlines()

    def header(names: str, cells: str) -> None:
        text = "\n".join([names, *(line + cells for line in lines[1:])])
        (tmp_path / "odom.csv").write_text(text + "\n")

    header("t,x,y,yaw,,", ",,")
    assert len(load_recording(path).odometry or ()) == len(o["t"])
    header("t,vx,y,yaw,x,x", ",0,0")
    path.write_text(ODOMETRY.replace('"x"', '"vx"'))
    assert len(load_recording(path).odometry or ()) == len(o["t"])
    path.write_text(ODOMETRY.replace('"x"', '"-x"'))
    assert "column '-x' is there twice" in refused(path)


@pytest.mark.parametrize(("clock", "wild"), [(0.0, 1e6), (1.7e9, 1e6), (1.7e9, -1e6)])
def test_a_wild_arrival_is_dropped(
    tmp_path: Path, recording: Recording, clock: float, wild: float
) -> None:
    """One cell cannot make the log last for days, nor shift the clock of all the others."""
    o = odometry_columns(recording)
    o["r"] = o["t"] + clock + 0.02
    o["r"][7] += wild
    log = load_recording(write_log(tmp_path, o, None, ODOMETRY + 'receive = "r"\n'))
    assert log.odometry is not None and len(log.odometry) == len(o["t"]) - 1
    assert log.odometry.arrival[-1] < 30.0
    assert np.ptp(log.odometry.arrival - log.odometry.t) < 1e-3
    assert "1 row dropped: arrival not within" in said(log)


def test_forward_without_gravity_is_refused(path: Path, recording: Recording) -> None:
    """An accelerometer of zeros tells no vertical."""
    i = imu_columns(recording)
    for name in ("ax", "ay", "az"):
        i[name] = 0.0 * i[name]
    write_csv(path.parent / "imu.csv", i)
    path.write_text(path.read_text() + 'forward = "+x"\n')
    assert "gravity has been taken out, so say how it is mounted" in refused(path)
