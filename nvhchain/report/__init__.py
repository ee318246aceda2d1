"""Results for people: figures, tables, sound files, summary.json and an HTML page."""

from nvhchain.report.case_record import recorded_case
from nvhchain.report.causes.contributions import contributions
from nvhchain.report.comparison import check_comparable, compare, write_run
from nvhchain.report.drawing import draw
from nvhchain.report.exchange import export_craig_bampton
from nvhchain.report.gear_pictures import draw_case, loaded_gear
from nvhchain.report.page import write_page
from nvhchain.report.system_modes import ModeReport, report_modes
from nvhchain.report.verdict import verdict

__all__ = [
    "ModeReport",
    "check_comparable",
    "compare",
    "contributions",
    "draw",
    "draw_case",
    "export_craig_bampton",
    "loaded_gear",
    "recorded_case",
    "report_modes",
    "verdict",
    "write_page",
    "write_run",
]
