"""Results for people: figures, tables, sound files, summary.json and an HTML page."""

from nvhchain.report.comparison import OPERATORS, check_comparable, compare
from nvhchain.report.contributions import contributions
from nvhchain.report.drawing import draw
from nvhchain.report.exchange import export_craig_bampton
from nvhchain.report.page import write_page

__all__ = ["OPERATORS", "check_comparable", "compare", "contributions", "draw", "export_craig_bampton", "write_page"]
