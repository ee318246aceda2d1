"""Files and words of a study: CSV tables, figures and the lines of its end."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from math import inf, isfinite
from pathlib import Path
from typing import Any

from nvhchain.files.hdf5 import write_text
from nvhchain.plots.designs import best_points, effect_bars, percentile_curves
from nvhchain.plots.files import save
from nvhchain.study._pyarrow import write_parquet
from nvhchain.study.analysis import (
    Effect,
    best_designs,
    confounded_names,
    idle_parameters,
    lacking,
    main_effects,
    main_response,
    pareto_pair,
    responses_of,
    sensitivity,
    single_changes,
    worst_rows,
)
from nvhchain.study.definition import DRAWN, PAIRED, Study
from nvhchain.study.differences import differences, order_doubt
from nvhchain.study.page import write_study_page
from nvhchain.study.plans.gradient import slopes
from nvhchain.study.plans.optimise import best_score, scores
from nvhchain.study.quality import count_text, failed_shares, influences, loudest, percentiles, share_text
from nvhchain.study.responses import is_level, response_title, response_unit
from nvhchain.study.rows import Point, Row


def write_study(study: Study, rows: Sequence[Row], out: str | Path) -> list[str]:
    """Write tables and figures of a study and return the lines that sum it up.

    Parameters
    ----------
    study : Study
        Study.
    rows : sequence of Row
        Rows of `run_study`.
    out : str or Path
        Folder.

    Returns
    -------
    list of str
        Best design, largest effects, parameters without effect, refused designs, remarks on the base case.

    Notes
    -----
    The file report.html is a page of everything. The file study.csv has a line for every run; study.parquet is the same
    table, if pyarrow is installed. Slopes of a plan `gradient` are in slopes.csv. Main effects are in effects.csv, the
    Sobol indices of a plan `sensitivity` in indices.csv. Plans of draws have percentiles.csv and ranking.csv, too.
    Figures (effects.png, pareto.png, percentiles.png) appear where responses differ.
    """
    folder = Path(out)
    write_text(folder / "study.csv", rows_csv(study, rows))
    write_parquet(records_of(study, rows), folder / "study.parquet")
    effects = main_effects(study, rows)
    write_text(folder / "effects.csv", _csv(_effect_record(study, effect) for effect in effects))
    lines = _search_lines(study, rows) if study.goal is not None else []
    if study.plan == "gradient":
        lines += _write_slopes(study, rows, folder)
    quality = _write_quality(study, rows, folder) if study.plan in DRAWN and main_response(rows) is not None else []
    summary = _summary(study, rows, effects)
    lines += [*quality, *summary] if study.is_series else [*summary, *quality]
    main = main_response(rows)
    if shown := [effect for effect in effects if effect.response == main and effect.change]:
        save(_effect_bars(shown), folder / "effects.png")
    if study.plan == "sensitivity" and rows and all(row.refused is None for row in rows):
        indices = sensitivity(study, rows)
        write_text(folder / "indices.csv", _csv(vars(index) for index in indices))
        lines += [
            f"{index.response}: {index.parameter} alone {share_text(index.first, index.first_limits)}, "
            f"with interactions {share_text(index.total, index.total_limits)}"
            for index in indices
            if index.response == main
        ]
        worst = worst_rows(rows)
        lines += [
            f"{name}: no Sobol indices, {lacking(worst, name)} of {len(worst)} designs lack it"
            for name in responses_of(worst)
            if lacking(worst, name)
        ]
    elif study.plan == "sensitivity":
        lines.append("Refused designs leave no Sobol indices: narrow the distributions")
    pair = study.pareto or (None if study.plan in DRAWN else pareto_pair(rows))
    if pair:
        worst = worst_rows(rows)
        best = best_designs(worst, *pair)
        found = {row.design: tuple(row.responses[name] for name in pair[::-1]) for row in best}
        others = [
            tuple(row.responses[name] for name in pair[::-1])
            for row in worst
            if all(name in row.responses for name in pair)
        ]
        save(best_points(others, found, titles=[response_title(name) for name in pair[::-1]]), folder / "pareto.png")
        several = "s" if len(best) > 1 else ""
        lines.append(f"Best in {pair[0]} and {pair[1]}: design{several} {', '.join(str(row.design) for row in best)}")
    write_study_page(study, rows, lines, folder)
    doubt = order_doubt(study, worst_rows(rows), main)
    return [*lines, *filter(None, [doubt]), *(remark for row in rows for remark in row.remarks)]


def _write_quality(study: Study, rows: Sequence[Row], folder: Path) -> list[str]:
    """Write percentiles, shares that fail and the ranking of the parameters; return the lines that sum them up."""
    main = str(main_response(rows))
    found = percentiles(rows, main)
    names = [main, *(name for name in study.targets if name != main)]
    every = [one for name in names for one in percentiles(rows, name)]
    write_text(folder / "percentiles.csv", _csv(_flat(one) for one in every))
    ranking = influences(study, rows, main)
    write_text(folder / "ranking.csv", _csv(_flat(one) for one in ranking))
    target = study.targets.get(main)
    worst, top = [row.responses[main] for row in worst_rows(rows) if main in row.responses], loudest(found)
    if len(worst) > 1:
        axes = percentile_curves(
            [(one.speed_rpm, one.percent, one.value) for one in found if one.torque == top.torque],
            worst,
            title=response_title(main),
            target=target,
            torque=top.torque,
            drawn=study.drawn,
        )
        save(axes, folder / "percentiles.png")
    lines = []
    for one in reversed(found):
        if (one.speed_rpm, one.torque) == (top.speed_rpm, top.torque):
            point_words = Point(one.speed_rpm, one.torque).words
            lines.append(
                f"{one.percent:g} % of {count_text(study, one)} have a {main}{point_words} below {one.value:.1f} "
                f"({_ends(one.limits)})"
            )
    for failed in failed_shares(study, rows):
        lines.append(
            f"{share_text(failed.share, failed.limits)} of {count_text(study, failed)} exceed {failed.response} = "
            f"{failed.target:g}"
        )
    lines += [
        f"{one.parameter} makes {share_text(one.share, one.share_limits)} of the variance of {main}"
        + ("" if one.correlation is None else f", rank correlation {one.correlation:.2f}")
        for one in ranking[:5]
    ]
    if study.plan == "sobol" or study.plan == "latin_hypercube":
        lines.append(
            f"plan = '{study.plan}': limits of percentiles and shares are those of independent draws, too wide"
        )
    return lines


def _flat(record: Any) -> dict[str, Any]:
    """Return the fields of a record, pairs of limits in two columns."""
    flat: dict[str, Any] = {}
    for name, value in vars(record).items():
        if isinstance(value, tuple):
            flat[f"{name}_lower"], flat[f"{name}_upper"] = value
        else:
            flat[name] = value
    return flat


def rows_csv(study: Study, rows: Sequence[Row]) -> str:
    """Return the table of all runs as CSV in ASCII; missing values are empty."""
    return _csv(records_of(study, rows))


def records_of(study: Study, rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return the table of all runs, such as for `pandas.DataFrame`.

    Parameters
    ----------
    study : Study
        Study.
    rows : sequence of Row
        Rows of `run_study`.

    Returns
    -------
    list of dict
        Column → value of every run, as in study.csv; None for a missing one. Columns "less design 0" have the
        difference of the level from design 0 at the same operating point, with limits in which common errors cancel.

    Examples
    --------
    >>> from nvhchain.study import Parameter, Row, Study, records_of
    >>> study = Study("case.toml", (Parameter("radius", ("body.radius_mm",), (5, 10)),))
    >>> records_of(study, [Row(0, {"radius": 5}, responses={"mass_kg": 0.5})])
    [{'design': 0, 'radius': 5, 'mass_kg': 0.5, 'seconds': 0.0, 'refused': None}]
    """
    responses = responses_of(rows)
    limited = [name for name in responses if any(name in row.limits for row in rows)]
    changes = differences(rows) if study.plan in PAIRED else {}
    records = []
    for index, row in enumerate(rows):
        record: dict[str, Any] = {"design": row.design, **row.values}
        record |= {"speed_rpm": row.speed_rpm, "torque_Nm": row.torque}
        for name in responses:
            record[name] = row.responses.get(name)
            if name in limited:
                record[f"{name} lower"], record[f"{name} upper"] = row.limits.get(name, (None, None))
        if changes:
            found = changes.get(index)
            record["less design 0"] = found.change if found else None
            record["less design 0 lower"], record["less design 0 upper"] = found.limits if found else (None, None)
        records.append(record | {"seconds": row.seconds, "refused": row.refused})
    kept = [name for name in records[0] if name not in ("speed_rpm", "torque_Nm") or records[0][name] is not None]
    return [{name: record[name] for name in kept} for record in records]


def _write_slopes(study: Study, rows: Sequence[Row], folder: Path) -> list[str]:
    """Write the slopes of all responses; return those of the main one in words."""
    found = slopes(study, rows)
    write_text(folder / "slopes.csv", _csv(_flat(one) for one in found))
    main = main_response(rows)
    return [
        f"One {study.unit(one.parameter) or 'unit'} of {one.parameter} changes {main}"
        f"{Point(one.speed_rpm, one.torque).words} by {one.value:.3g}{_unit(main, difference=True)} "
        + (f"({_ends(one.limits, 3)}; " if any(limit is not None for limit in one.limits) else "(")
        + f"difference quotient ± {one.error:.1g})"
        for one in found
        if one.response == main
    ]


def _search_lines(study: Study, rows: Sequence[Row]) -> list[str]:
    """Return the result of a search in words: best design, and its difference from the base case."""
    assert study.goal is not None
    name, percent = study.goal.response, study.goal.percent
    share = f"{percent:g} % of {study.goal.draws} gearboxes below " if study.goal.draws else ""
    best, (base, *_) = best_score(study, rows), scores(study, rows)
    outside = [study.text(name, base.values[name]) for name in base.forbidden]
    lies = [f"Design 0, the base case, lies outside the search: {', '.join(outside)}"] if outside else []
    if best is None:
        return ["No design meets all targets: widen the ranges, or raise the targets", *lies]
    given = ", ".join(study.text(*one)[:60] for one in best.values.items())
    form = ".1f" if is_level(name) else ".4g"
    lines = [f"Best {name}: {share}{best.responses[name]:{form}}, design {best.design} ({given})"]
    if base.responses and base.design != best.design:
        change = best.responses[name] - base.responses[name]
        missed = ", which misses a target" if base.excess > 0 else ""
        lines.append(f"Difference from design 0, the base case{missed}: {change:+{form}}{_unit(name, difference=True)}")
    return lines + lies


def _csv(records: Iterable[Mapping[str, Any]]) -> str:
    records = list(records)
    if not records:
        return ""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(records[0]), lineterminator="\n")
    writer.writeheader()
    for record in records:
        writer.writerow({name: _cell(value) for name, value in record.items()})
    return text.getvalue().encode("ascii", "backslashreplace").decode()


def _cell(value: Any) -> Any:
    if isinstance(value, float):
        return f"{value:.9g}" if isfinite(value) else ""
    return "" if value is None else value


def _effect_record(study: Study, effect: Effect) -> dict[str, Any]:
    return {
        "response": effect.response,
        "parameter": effect.parameter,
        "unit": study.unit(effect.parameter),
        "change": effect.change,
        "lowest_at": effect.lowest,
        "highest_at": effect.highest,
        "share_of_variance": effect.share,
        "share_by_chance": effect.chance,
    }


def _summary(study: Study, rows: Sequence[Row], effects: Sequence[Effect]) -> list[str]:
    lines, main = [], main_response(rows)
    heard = [row for row in worst_rows(rows) if main is not None and main in row.responses]
    if main is not None and heard and study.plan not in ("optimise", "gradient") and not study.is_series:
        form, several = ".1f" if is_level(main) else ".4g", ""
        if len({(row.speed_rpm, row.torque) for row in rows}) > 1:
            several = " (worst operating point)"
        for word, row in (
            ("Lowest", min(heard, key=lambda row: row.responses[main])),
            ("Highest", max(heard, key=lambda row: row.responses[main])),
        ):
            given = ", ".join(study.text(*one)[:60] for one in _given(row).items())
            lines.append(
                f"{word} {main}{several}: {row.responses[main]:{form}}{_unit(main)}{_limits(row, main)}, "
                f"design {row.design} ({given})"
            )
        if study.targets and study.plan not in DRAWN:
            met = [str(row.design) for row in heard if _meets(study, row)]
            count, missing = len(heard), len({row.design for row in rows}) - len(heard)
            whole = f" with all results (of {count + missing})" if missing else ""
            named = f": {', '.join(met[:20])}{', …' if len(met) > 20 else ''}" if met else ""
            lines.append(f"{len(met)} of {count} designs{whole} meet all targets{named}")
        stated = effects if study.plan != "sensitivity" else ()
        for effect in [effect for effect in stated if effect.response == main and effect.change][:3]:
            name, _, unit = study.title(effect.parameter).partition(" / ")
            unit = f" {unit}".rstrip()
            lines.append(
                f"{name} changes {main} by {effect.change:.3g}{_unit(main, difference=True)} on average "
                f"({_short(effect.lowest)}{unit} lowest, {_short(effect.highest)}{unit} highest): "
                f"{100 * effect.share:.0f} % of its variance{', no more than chance' if effect.unclear else ''}"
            )
    confounded = confounded_names(study, rows)
    if confounded:
        lines.append(
            f"No effects of {', '.join(confounded)}: their values change together, or runs are missing; a grid without "
            "refused designs separates them"
        )
    idle = idle_parameters(study, rows)
    if idle:
        lines.append(f"No response depends on {', '.join(idle)}")
    changes = single_changes(study, [row for row in rows if row.refused is None]) if study.plan == "optimise" else {}
    unclear = [name for name, pairs in changes.items() if not pairs and name not in idle]
    if unclear and main is not None:
        lines.append(f"No two designs differ in {' or '.join(unclear)} alone, which may have no effect")
    refused = [row for row in rows if row.refused is not None]
    if refused:
        lines.append(f"{len(refused)} of {len(rows)} runs were refused, the first: {refused[0].refused}")
    return lines


def _meets(study: Study, row: Row) -> bool:
    """Return True if a design keeps all targets at its worst operating point."""
    return all(row.responses.get(name, inf) <= target for name, target in study.targets.items())


def _given(row: Row) -> dict[str, Any]:
    points = {"speed_rpm": row.speed_rpm, "torque_Nm": row.torque}
    return row.values | {name: value for name, value in points.items() if value is not None}


def _unit(name: str, *, difference: bool = False) -> str:
    """Return the unit of a response, or of its differences, after a blank; empty for a response without one."""
    return f" {response_unit(name, difference=difference)}".rstrip()


def _limits(row: Row, name: str) -> str:
    if name not in row.limits:
        return ""
    return f" ({_ends(row.limits[name])})"


def _ends(limits: Iterable[float | None], digits: int | None = None) -> str:
    """Return limits in words, with one decimal or a number of significant digits."""
    form = ".1f" if digits is None else f".{digits}g"
    return "…".join("none" if limit is None or not isfinite(limit) else f"{limit:{form}}" for limit in limits)


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)[:40]


def _effect_bars(effects: Sequence[Effect]) -> list[Any]:
    notes = [f"{_short(effect.lowest)} to {_short(effect.highest)}" for effect in effects]
    bars = {effect.parameter: effect.change for effect in effects}
    return effect_bars(
        bars, notes, [effect.unclear for effect in effects], title=response_title(effects[0].response, difference=True)
    )
