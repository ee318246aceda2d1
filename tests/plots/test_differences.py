"""The table of differences holds levels, differences to the first configuration and dashes for absent lines."""

import csv
import io

from nvhchain.plots import difference_table


def summary(overall, *lines):
    orders = [{"order": o, "frequency_hz": o * 125 / 3, "level_db": level} for o, level in lines]
    return {"input_speed_rpm": 2500.0, "overall_dBA": overall, "orders": orders}


CONFIGURATIONS = {
    "solid": summary(70.0, (12.0, 60.0), (20.0, 65.0), (24.0, 10.0)),
    "slotted": summary(72.5, (12.0, 58.5), (18.0, 50.0), (20.0, 66.0)),
}


def test_rows_are_overall_then_the_strongest_orders_in_rising_order():
    table = difference_table(CONFIGURATIONS, strongest=3)
    assert table.header == ("quantity", "f / Hz", "solid", "slotted", "slotted − solid")
    assert table.rows == (
        ("overall / dB(A)", "", "70.0", "72.5", "+2.5"),
        ("order 12 / dB", "500.0", "60.0", "58.5", "−1.5"),
        ("order 18 / dB", "750.0", "–", "50.0", "–"),
        ("order 20 / dB", "833.3", "65.0", "66.0", "+1.0"),
    )


def test_csv_has_ascii_minus_signs_and_empty_cells_for_absent_values():
    table = difference_table(CONFIGURATIONS)
    rows = list(csv.reader(io.StringIO(table.csv(), newline="")))
    assert rows[0][-1] == "slotted - solid"
    assert rows[3] == ["order 18 / dB", "750.0", "", "50.0", ""]
    assert table.csv().isascii()


def test_text_and_csv_hold_the_same_cells():
    table = difference_table(CONFIGURATIONS)
    cells = [list(row) for row in (table.header, *table.rows)]
    plain = [[cell.replace("–", "").replace("−", "-") for cell in row] for row in cells]
    assert list(csv.reader(io.StringIO(table.csv(), newline=""))) == plain
    lines = table.text().splitlines()
    assert len({len(line) for line in lines}) == 1
    assert len(lines) == len(cells)


def test_rounding_of_the_fourier_transform_is_no_line():
    table = difference_table(
        {"solid": summary(70.0, (20.0, 65.0), (22.0, -36.0), (24.0, -34.0)), "slotted": summary(72.5, (22.0, 53.1))}
    )
    assert table.rows[2] == ("order 22 / dB", "916.7", "–", "53.1", "–")
    assert table.rows[3][0] == "order 24 / dB"
    assert table.rows[3][2] == "−34.0"


def run_up(speeds, levels, limits, highest):
    rows = [
        {"speed_rpm": speed, "level_dBA": level, "limits_dBA": edges}
        for speed, level, edges in zip(speeds, levels, limits, strict=True)
    ]
    found = {"order 20 (stage1 × 1), dB": {"level_db": highest, "speed_rpm": speeds[-1]}}
    return {"overall_dBA": 60.0, "error_band_dBA": [None, 61.0], "over_speed": rows, "highest": found}


def test_run_ups_are_compared_at_the_speeds_of_the_first_with_their_limits():
    first = run_up([1000, 2000, 3000], [50, 60, 70], [[None, 55], [58, 62], [68, 72]], 65.0)
    second = run_up([2500, 1500], [66, 56], [[60, 70], [50, 60]], 68.0)
    second["highest"]["order 20 (stage1 × 1), dB"]["limits_db"] = [66.0, 71.0]
    rows = list(csv.reader(io.StringIO(difference_table({"a": first, "b": second}).csv())))
    assert rows[0] == [
        "quantity", "n / rpm", "a", "b", "b - a", "a lower limit", "a upper limit", "b lower limit", "b upper limit",
    ]  # fmt: skip
    assert rows[1] == ["whole record / dB(A)", "", "60.0", "60.0", "0.0", "", "61.0", "", "61.0"]
    assert rows[2] == ["at a speed / dB(A)", "1000", "50.0", "", "", "", "55.0", "", ""]
    assert rows[3] == ["at a speed / dB(A)", "2000", "60.0", "61.0", "+1.0", "58.0", "62.0", "55.0", "65.0"]
    highest = ["highest order 20 (stage1 × 1) / dB", "3000; 1500", "65.0", "68.0", "+3.0"]
    assert rows[5] == [*highest, "", "", "66.0", "71.0"]
