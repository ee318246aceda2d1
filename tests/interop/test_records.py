"""Records of measuring systems: tables of any code page, LabVIEW, TDMS, MDF4, universal files of many quantities."""

import re

import numpy as np
import pytest

from nvhchain.errors import FileFormatError, InputError
from nvhchain.interop import read_record

TIME = np.arange(8) * 1e-3
SPEED = 1500.25 + np.arange(8)
FORCE = -2.5 + 0.75 * np.arange(8)


def expect(record, *, time=True):
    np.testing.assert_allclose(record.values("Drehzahl"), SPEED)
    np.testing.assert_allclose(record.values("Kraft Fx"), FORCE)
    assert record.units == {"Drehzahl": "1/min", "Kraft Fx": "kN"} or time is None
    if time:
        np.testing.assert_allclose(record.time_of(["Drehzahl", "Kraft Fx"]), TIME, atol=1e-12)


def table(separator, decimal):
    rows = [["Zeit", "Drehzahl", "Kraft Fx"], ["µs", "1/min", "kN"]]
    rows += [[f"{x:.6f}".replace(".", decimal) for x in row] for row in zip(1e6 * TIME, SPEED, FORCE, strict=True)]
    return "Prüfstand 7; geprüft\r\n" + "".join(separator.join(row) + "\r\n" for row in rows)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
@pytest.mark.parametrize(("separator", "decimal"), [(";", ","), (";", "."), ("\t", ","), (",", ".")])
def test_tables_of_any_spreadsheet_are_read(separator, decimal, encoding, tmp_path):
    (tmp_path / "a.csv").write_bytes(table(separator, decimal).encode(encoding))
    record = read_record(tmp_path / "a.csv")
    np.testing.assert_allclose(record.values("Drehzahl"), SPEED)
    np.testing.assert_allclose(record.values("Kraft Fx"), FORCE)
    assert dict(record.units) == {"Zeit": "µs", "Drehzahl": "1/min", "Kraft Fx": "kN"}


@pytest.mark.parametrize("text", ["t;x\n0,0;1.234,5\n1,0;2\n", "t;x\n0,0;1,5\n1,0;2.5\n", "t\tx\n0,0\t1\n1,0\n"])
def test_marks_of_thousands_and_mixed_marks_are_refused(text, tmp_path):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(FileFormatError, match="not a table of numbers"):
        read_record(tmp_path / "a.csv")


HEAD = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t{decimal}
Multi_Headings\tNo
X_Columns\t{columns}
Time_Pref\tRelative
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t8\t8\t
Date\t2026/11/26\t2026/11/26\t
Y_Unit_Label\t1/min\tkN\t
X_Dimension\tTime\tTime\t
X0\t0.0E+0\t0.0E+0\t
Delta_X\t0.001\t0.001\t
***End_of_Header***\t\t\t
"""


def lvm(columns, decimal):
    cells = {"No": "\t{s}\t{f}\t", "One": "{t}\t{s}\t{f}\t", "Multi": "{t}\t{s}\t{t}\t{f}\t"}[columns]
    names = (
        "X_Value\tDrehzahl\tX_Value\tKraft Fx\tComment"
        if columns == "Multi"
        else "X_Value\tDrehzahl\tKraft Fx\tComment"
    )
    head = HEAD.format(columns=columns, decimal=decimal)
    head = head.replace("0.001", "0.001".replace(".", decimal)).replace("0.0E+0", "0.0E+0".replace(".", decimal))
    lines = [cells.format(t=f"{t:.6f}", s=f"{s:.6f}", f=f"{f:.9f}").replace(".", decimal)
             for t, s, f in zip(TIME, SPEED, FORCE, strict=True)]  # fmt: skip
    lines[0] += "started by hand"
    return head + "\n".join([names, *lines, ""])


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("columns", ["No", "One", "Multi"])
def test_labview_text_with_and_without_columns_of_time(columns, decimal, tmp_path):
    (tmp_path / "a.lvm").write_text(lvm(columns, decimal))
    expect(read_record(tmp_path / "a.lvm"))
    text = (tmp_path / "a.lvm").read_text()
    for changed, message in (
        (text.replace("Samples\t8\t8", "Samples\t9\t9"), "declares 9 samples and holds 8"),
        (text + HEAD, "has 3 segments"),
        (text[5:], "does not begin with LabVIEW"),
        (text.replace("Channels\t2", "Channels\t9999999"), "damaged LabVIEW"),
    ):
        (tmp_path / "b.lvm").write_text(changed)
        with pytest.raises(InputError, match=message):
            read_record(tmp_path / "b.lvm")


def test_tdms_with_steps_units_and_groups(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    properties = {"wf_increment": 1e-3, "wf_start_offset": 0.0}
    channels = [
        nptdms.ChannelObject("A", "Drehzahl", SPEED, properties | {"unit_string": "1/min"}),
        nptdms.ChannelObject("A", "Kraft Fx", FORCE, properties | {"unit_string": "kN"}),
        nptdms.ChannelObject("A", "twice", FORCE),
        nptdms.ChannelObject("B", "twice", SPEED),
        nptdms.ChannelObject("B", "text", ["a", "b"]),
    ]
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment(channels)
    record = read_record(tmp_path / "a.tdms")
    expect(record)
    assert set(record.channels) == {"Drehzahl", "Kraft Fx", "A/twice", "B/twice"}
    for end, message in ((40, "no channel with numbers"), (-9, "last segment is incomplete")):
        (tmp_path / "b.tdms").write_bytes((tmp_path / "a.tdms").read_bytes()[:end])
        with pytest.raises(FileFormatError, match=message):
            read_record(tmp_path / "b.tdms")


def test_mdf4_with_times_and_units(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        signals = [("Drehzahl", SPEED, "1/min"), ("Kraft Fx", FORCE, "kN")]
        file.append([asammdf.Signal(v, TIME, name=n, unit=u) for n, v, u in signals])
        file.save(tmp_path / "a.mf4", overwrite=True)
    expect(read_record(tmp_path / "a.mf4"))
    (tmp_path / "b.mf4").write_bytes((tmp_path / "a.mf4").read_bytes()[:100])
    with pytest.raises(FileFormatError, match="damaged, truncated or no MDF"):
        read_record(tmp_path / "b.mf4")


def test_samples_of_mdf4_that_are_marked_invalid_are_left_out(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    wrong, bad = FORCE.copy(), np.zeros(len(FORCE), dtype=bool)
    wrong[5], bad[5] = 9999.0, True
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(wrong, TIME, name="Kraft Fx", unit="kN", invalidation_bits=bad)])
        file.append([asammdf.Signal(SPEED, TIME, name="Drehzahl", unit="1/min")])
        file.save(tmp_path / "a.mf4", overwrite=True)
    record = read_record(tmp_path / "a.mf4")
    force = next(channel for name, channel in record.channels.items() if name.endswith("Kraft Fx"))
    assert np.abs(force).max() < 2 * np.abs(FORCE).max()


def uff(kind, values, declared=None):
    none = f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20} {'NONE':20}"
    head = [f"{-1:6d}", f"{58:6d}", *[f"{'NONE':80}"] * 5]
    head += [f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':>10}{7:10d}{1:4d} {'NONE':>10}{0:10d}{0:4d}"]
    head += [f"{4:10d}{declared or len(values):10d}{1:10d}{0:13.5e}{1e-3:13.5e}{0:13.5e}"]
    head += [
        f"{17:10d}{0:5d}{0:5d}{0:5d} {'time':20} {'s':20}",
        f"{kind:10d}{0:5d}{0:5d}{0:5d} {'NONE':20} {'NONE':20}",
    ]
    rows = ["".join(f"{x:20.11e}" for x in values[i : i + 4]) for i in range(0, len(values), 4)]
    return "\n".join([*head, none, none, *rows, f"{-1:6d}", ""])


def test_quantities_at_one_node_are_told_apart_by_their_type(tmp_path):
    path = tmp_path / "a.uff"
    path.write_text(uff(12, SPEED) + uff(13, FORCE) + uff(8, TIME))
    record = read_record(path)
    assert set(record.channels) == {"7:x", "7:x:acceleration", "7:x:displacement"}
    np.testing.assert_allclose(record.values("7:x"), FORCE)
    path.write_text(uff(9, SPEED) + uff(13, FORCE))
    record = read_record(path)
    np.testing.assert_allclose(record.values("7:x:excitation force"), FORCE)
    np.testing.assert_allclose(record.values("7:x:reaction force"), SPEED)
    path.write_text(uff(13, SPEED) + uff(13, FORCE))
    with pytest.raises(InputError, match="two time responses"):
        read_record(path).values("7:x")


def test_a_universal_file_that_declares_more_values_than_it_holds_is_refused(tmp_path):
    (tmp_path / "a.uff").write_text(uff(13, FORCE, 9))
    with pytest.raises(InputError, match=re.escape("holds 8 values of 9 that it declares")):
        read_record(tmp_path / "a.uff").values("7:x")
