"""Results for people: figures, tables, sound files, summary.json and an HTML page."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.report.case_record import recorded_case
    from nvhchain.report.comparison import check_comparable, compare, write_run
    from nvhchain.report.exchange import export_craig_bampton
    from nvhchain.report.page import write_page
    from nvhchain.report.parts import contributions
    from nvhchain.report.pictures.drawing import draw
    from nvhchain.report.pictures.gears import draw_case, loaded_gear
    from nvhchain.report.sentences import verdict
    from nvhchain.report.system_modes import report_modes
    from nvhchain.report.unchanged import stands_already
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__ = ["compare", "contributions", "verdict"]
