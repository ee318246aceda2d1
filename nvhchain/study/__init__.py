"""Studies: many designs of one case at several speeds and torques, their table, effects and best designs."""

from nvhchain.study.analysis import best_designs, idle_parameters, indices_from, main_effects, sensitivity, worst_rows
from nvhchain.study.definition import Goal, Study, load_study
from nvhchain.study.differences import differences
from nvhchain.study.measuring import measure, measure_drawn
from nvhchain.study.parameter import Parameter
from nvhchain.study.plans.costs import Cost, costs, disk_bytes, further_runs
from nvhchain.study.plans.designs import count_designs, list_designs
from nvhchain.study.plans.gradient import slopes
from nvhchain.study.plans.optimise import best_score, scores
from nvhchain.study.quality import failed_shares, influences, percentiles
from nvhchain.study.rows import Row, operating_points
from nvhchain.study.running import check_disk, check_parameters, remarks, run_study
from nvhchain.study.tables import records_of, rows_csv, write_study

__all__ = [
    "Parameter",
    "Study",
    "load_study",
    "main_effects",
    "percentiles",
    "records_of",
    "run_study",
    "sensitivity",
    "write_study",
]
