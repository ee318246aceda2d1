"""Studies: many designs of one case at several speeds and torques, their table, effects and best designs."""

from nvhchain.study.analysis import (
    Effect,
    SobolIndex,
    best_designs,
    idle_parameters,
    indices_from,
    main_effects,
    responses_of,
    sensitivity,
    worst_rows,
)
from nvhchain.study.definition import Goal, Study, load_study
from nvhchain.study.differences import Difference, differences, level_difference
from nvhchain.study.measuring import measure, measure_drawn
from nvhchain.study.parameter import Parameter
from nvhchain.study.plans.costs import Cost, costs
from nvhchain.study.plans.designs import Design, count_designs, list_designs
from nvhchain.study.plans.gradient import Slope, slopes
from nvhchain.study.plans.optimise import Score, best_score, scores
from nvhchain.study.quality import FailedShare, Influence, Percentile, failed_shares, influences, percentiles
from nvhchain.study.rows import Point, Row, operating_points
from nvhchain.study.running import check_parameters, run_study
from nvhchain.study.tables import rows_csv, write_study

__all__ = [
    "Cost",
    "Design",
    "Difference",
    "Effect",
    "FailedShare",
    "Goal",
    "Influence",
    "Parameter",
    "Percentile",
    "Point",
    "Row",
    "Score",
    "Slope",
    "SobolIndex",
    "Study",
    "best_designs",
    "best_score",
    "check_parameters",
    "costs",
    "count_designs",
    "differences",
    "failed_shares",
    "idle_parameters",
    "indices_from",
    "influences",
    "level_difference",
    "list_designs",
    "load_study",
    "main_effects",
    "measure",
    "measure_drawn",
    "operating_points",
    "percentiles",
    "responses_of",
    "rows_csv",
    "run_study",
    "scores",
    "sensitivity",
    "slopes",
    "worst_rows",
    "write_study",
]
