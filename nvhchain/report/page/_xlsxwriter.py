"""Door to XlsxWriter (extra `excel`): tables as sheets of a workbook."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO

import xlsxwriter

Cell = str | float | None
"""Content of a cell; None is empty."""


def workbook(sheets: Sequence[tuple[str, str, Sequence[Sequence[Cell]]]]) -> bytes:
    """Return the content of a workbook from names, captions and rows of sheets; the first row holds the titles."""
    file = BytesIO()
    with xlsxwriter.Workbook(
        file, {"in_memory": True, "strings_to_formulas": False, "nan_inf_to_errors": True}
    ) as book:
        bold = book.add_format({"bold": True})
        for name, caption, rows in sheets:
            sheet = book.add_worksheet(name)
            sheet.write_string(0, 0, caption)
            for column, title in enumerate(rows[0]):
                sheet.write_string(1, column, str(title), bold)
            for row, cells in enumerate(rows[1:], start=2):
                for column, cell in enumerate(cells):
                    if isinstance(cell, float | int):
                        sheet.write_number(row, column, cell)
                    elif cell:
                        sheet.write_string(row, column, cell)
            sheet.freeze_panes(2, 0)
            sheet.autofit(240)
    return file.getvalue()
