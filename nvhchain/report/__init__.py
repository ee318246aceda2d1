"""What is made for people: figures, tables, sound files, summary.json and a page that shows them."""

from nvhchain.report.comparison import compare
from nvhchain.report.contributions import contributions
from nvhchain.report.drawing import draw
from nvhchain.report.exchange import export_craig_bampton
from nvhchain.report.page import write_page

__all__ = ["compare", "contributions", "draw", "export_craig_bampton", "write_page"]
