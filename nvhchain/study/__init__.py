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
from nvhchain.study.definition import Parameter, Study, load_study
from nvhchain.study.designs import Design, count_designs, list_designs
from nvhchain.study.measuring import measure, measure_drawn
from nvhchain.study.quality import FailedShare, Influence, Percentile, failed_shares, influences, percentiles
from nvhchain.study.running import Point, Row, check_parameters, operating_points, run_study
from nvhchain.study.tables import rows_csv, write_study

__all__ = [
    "Design",
    "Effect",
    "FailedShare",
    "Influence",
    "Parameter",
    "Percentile",
    "Point",
    "Row",
    "SobolIndex",
    "Study",
    "best_designs",
    "check_parameters",
    "count_designs",
    "failed_shares",
    "idle_parameters",
    "indices_from",
    "influences",
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
    "sensitivity",
    "worst_rows",
    "write_study",
]
