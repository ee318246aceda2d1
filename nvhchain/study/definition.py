"""Studies: a base case, its parameters and the plan of designs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

from nvhchain.case.checks.names import nearest
from nvhchain.case.toml.read import check_texts, read_toml
from nvhchain.dimensions import strip_unit
from nvhchain.errors import InputError, Mistakes, check_all, is_whole, mistakes, require, require_all, require_each
from nvhchain.kinds import check_fields
from nvhchain.names import check_names
from nvhchain.study.parameter import Parameter, numbers, parameter_from
from nvhchain.study.responses import OPTIONAL_RESPONSES

Plan = Literal["grid", "list", "monte_carlo", "latin_hypercube", "sobol", "sensitivity", "optimise", "gradient"]
"""Name of a plan."""
FEWEST_EVALUATIONS = 10
"""Smallest number of designs of a search."""
DRAWN = ("monte_carlo", "latin_hypercube", "sobol")
"""Plans whose designs stand for what leaves the factory."""
PAIRED = ("grid", "list", "optimise", "gradient")
"""Plans whose design 0 is one to compare others with."""
_COLUMNS = ("design", "speed_rpm", "torque_Nm", "seconds", "refused")
"""Columns of the table of runs that are no parameters."""
_RESPONSE = re.compile(
    r"(level|sound_power|loudness_sone|loudest order|mass_kg|inertia_kg_m2"
    r"|level at .+|order .+ x \d+|(transmission_error_um|root_stress_MPa|contact_pressure_MPa) of .+)"
    r"( lower| upper)?|less design \d+( lower| upper)?"
)
"""Names of responses, of their limits, and of differences from a design: columns, too."""


@dataclass(frozen=True)
class Goal:
    """Goal of the plan `optimise`: the smallest value of a response within the targets of others.

    Parameters
    ----------
    response : str
        Response, at its worst operating point.
    scatter : tuple of Parameter
        Tolerances: distributions of which every design has the same draws.
    draws : int
        Number of gearboxes per design; 0 without `scatter`.
    percent : float
        Percentage of the gearboxes that a value includes, above 0 and at most 100.

    Raises
    ------
    InputError
        If scatter and draws do not fit.
    """

    response: str = "level"
    scatter: tuple[Parameter, ...] = ()
    draws: int = 0
    percent: float = 95.0

    def __post_init__(self) -> None:
        check_fields(self)
        require(is_whole(self.draws) and self.draws >= 0, f"draws = {self.draws:g} must be a whole number, 0 or more")
        require(0 < self.percent <= 100, f"percent = {self.percent:g} must be above 0 and at most 100")
        require(
            (self.draws > 0) == bool(self.scatter),
            f"draws = {self.draws} with {len(self.scatter)} tolerances: give [[scatter]] and draws, or neither",
        )
        for tolerance in self.scatter:
            require(not tolerance.levels, f"{tolerance.name}: a tolerance has a distribution, or draw = true")


@dataclass(frozen=True)
class Study:
    """Base case, parameters, plan and operating points.

    Parameters
    ----------
    case : str or Path
        File of the base case.
    parameters : tuple of Parameter
        Parameters.
    plan : str
        Plan: `grid` has every combination of values, `list` the n-th values of all parameters together.
        `monte_carlo` has independent draws, for percentiles and shares that fail. `latin_hypercube` and `sobol` fill
        the space evenly, `sensitivity` is for Sobol indices. `optimise` searches for the best design, `gradient`
        has slopes at the middle of every range.
    designs : int
        Number of designs, a power of two for `sobol` and `sensitivity`. The latter multiplies it by the number of
        parameters plus two. For `optimise` the largest number. `grid`, `list` and `gradient` have their own.
    seed : int
        Seed of plans with a number of designs, and of the draws of a search.
    speeds_rpm : tuple of float
        Speeds of the input shaft (rpm) at which every design runs; that of the case by default.
    torques : tuple of float
        Torques on the input shaft (N·m), each with every speed; that of the case by default.
    pareto : tuple of str
        Two responses, both better the smaller, of the figure of best designs.
    targets : dict of str to float
        Response → largest value that passes, such as level = 65; at the worst operating point. Draws have the share
        that fails, other plans the designs that pass.
    most_designs : int
        Number of designs above which a plan is refused; each draw of a search counts.
    responses : tuple of str
        Further responses: `orders`, `loudness`, `contact_pressure`.
    goal : Goal, optional
        Goal of the plan `optimise`.

    Raises
    ------
    InputError
        If parameters share a name, or the plan does not fit them.
    """

    case: str | Path
    parameters: tuple[Parameter, ...]
    plan: Plan = "grid"
    designs: int = 0
    seed: int = 1
    speeds_rpm: tuple[float, ...] = ()
    torques: tuple[float, ...] = ()
    pareto: tuple[str, ...] = ()
    targets: Mapping[str, float] = field(default_factory=dict)
    most_designs: int = 10_000
    responses: tuple[str, ...] = ()
    goal: Goal | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        require(len(self.parameters) > 0, "a study without parameters has one design: use run, or add [[parameters]]")
        check_all(
            self._check_numbers,
            self._check_names,
            self._check_paths,
            self._check_plan,
            self._check_goal,
            self._check_points_and_responses,
        )

    @property
    def varied(self) -> tuple[Parameter, ...]:
        """Parameters, and tolerances of a search."""
        return (*self.parameters, *(self.goal.scatter if self.goal is not None else ()))

    def unit(self, name: str) -> str:
        """Return the unit of a parameter in print; empty for a number."""
        return next((parameter.unit for parameter in self.varied if parameter.name == name), "")

    def title(self, name: str) -> str:
        """Return name and unit of a parameter, of the speed or of the torque."""
        titles = {parameter.name: parameter.title for parameter in self.varied}
        return ({"speed_rpm": "speed / rpm", "torque_Nm": "torque / N m"} | titles).get(name, name)

    def text(self, name: str, value: object) -> str:
        """Return name, value and unit of a parameter, of the speed or of the torque."""
        points = {"speed_rpm": "speed = {:g} rpm", "torque_Nm": "torque = {:g} N m"}
        if name in points:
            return points[name].format(value)
        return next(parameter.text(value) for parameter in self.varied if parameter.name == name)

    @property
    def scatter(self) -> tuple[Parameter, ...]:
        """Parameters of the scatter of production, if those are deviations, tolerances and damping alone."""
        drawn = self.varied[len(self.parameters) :] if self.plan in PAIRED else self.parameters
        return drawn if all(one.is_scatter for one in drawn) else ()

    @property
    def is_series(self) -> bool:
        """True for draws of one design: plan `monte_carlo`, or nothing but the scatter of production varies."""
        return self.plan in DRAWN and (self.plan == "monte_carlo" or bool(self.scatter))

    @property
    def drawn(self) -> str:
        """Word for the designs of a plan of draws."""
        return "gearboxes" if self.is_series else "designs"

    def _check_numbers(self) -> None:
        whole = (("seed", self.seed), ("designs", self.designs), ("most_designs", self.most_designs))
        require_each(
            *(
                (is_whole(number) and number >= 0, f"{name} = {number:g} must be a whole number, 0 or more")
                for name, number in whole
            )
        )
        for name, number in whole:
            object.__setattr__(self, name, int(number))

    def _check_names(self) -> None:
        check_names([parameter.name for parameter in self.varied], "parameters")
        require_all(
            f"{name} is a column of every table: choose another name"
            if name in _COLUMNS
            else f"{name} is the name of a response or of its limits: choose another name"
            for name in (parameter.name for parameter in self.varied)
            if name in _COLUMNS or _RESPONSE.fullmatch(name)
        )

    def _check_plan(self) -> None:
        plan, designs = self.plan, self.designs
        require(plan in get_args(Plan), f"plan: no {plan!r}: {nearest(plan, get_args(Plan))}")
        lengths = {parameter.name: len(parameter.levels) for parameter in self.parameters}
        if plan in ("grid", "list"):
            require_each(
                (designs == 0, f"designs = {designs:g}: plan = '{plan}' has those of its values"),
                *(
                    (length > 0, f"{name}: plan = '{plan}' needs values: give them, or another plan")
                    for name, length in lengths.items()
                ),
            )
        elif plan == "gradient":
            require_each(
                (designs == 0, f"designs = {designs:g}: plan = 'gradient' has as many as its steps need"),
                *(
                    (
                        not parameter.levels and not parameter.draw,
                        f"{parameter.name}: slopes need a range: give low and high, or mean and deviation",
                    )
                    for parameter in self.parameters
                ),
            )
        else:
            require(designs > 0, f"designs = {designs:g}: plan = '{plan}' needs a positive number")
        if plan == "list":
            require(len(set(lengths.values())) == 1, f"plan = 'list' needs as many values everywhere, not {lengths}")
        if plan in ("sobol", "sensitivity") and is_whole(designs):
            power = 1 << int(designs).bit_length()
            require(
                2 * int(designs) in (power, 0),
                f"designs = {designs:g}: plan = '{plan}' needs a power of two, such as {power}",
            )

    def _check_points_and_responses(self) -> None:
        require_each(
            *(
                (len(set(values)) == len(values), f"{name} = {list(values)} repeats a value: give each one once")
                for name, values in (("speeds_rpm", self.speeds_rpm), ("torques", self.torques))
            ),
            *(
                (
                    name in OPTIONAL_RESPONSES,
                    f"responses: no {name!r} on request: choose among {', '.join(OPTIONAL_RESPONSES)}",
                )
                for name in self.responses
            ),
            (len(self.pareto) in (0, 2), f"pareto = {self.pareto}: name two responses, such as ['level', 'mass_kg']"),
        )

    def _check_paths(self) -> None:
        """Refuse places of the case that two parameters set, or a parameter and the operating points."""
        points = (("operation.input_speed_rpm", "speeds_rpm"), ("operation.input_torque", "torques"))
        owners = {strip_unit(path): name for path, name in points if getattr(self, name)}
        for parameter in self.varied:
            own = {strip_unit(path): path for path in parameter.given_paths}
            for place, path in own.items():
                for other, owner in owners.items():
                    require(
                        not f"{place}.".startswith(f"{other}.") and not f"{other}.".startswith(f"{place}."),
                        f"{parameter.name} and {owner} both set {path}, and only the last one counts: leave one of "
                        "them out",
                    )
            owners |= dict.fromkeys(own, parameter.name)

    def _check_goal(self) -> None:
        require(
            (self.plan == "optimise") == (self.goal is not None),
            "plan = 'optimise' needs [optimise], such as response = \"level\"; other plans have none",
        )
        if self.plan != "optimise":
            return
        require(
            self.designs >= FEWEST_EVALUATIONS,
            f"designs = {self.designs}: a search needs {FEWEST_EVALUATIONS} or more",
        )
        for parameter in self.parameters:
            require(
                bool(parameter.levels) or parameter.low is not None,
                f"{parameter.name}: a search needs low and high, values or variants; tolerances belong to [[scatter]]",
            )


def load_study(path: str | Path) -> Study:
    """Read and validate a study (TOML).

    Parameters
    ----------
    path : str or Path
        TOML file; its `case` is relative to it.

    Returns
    -------
    Study
        Study.

    Raises
    ------
    InputError
        If the file cannot be used; all mistakes at once.
    """
    path = Path(path)
    table, _ = read_toml(path)
    check_texts(table, f"{path}")
    wrong: list[str] = []
    parameters = _parameters(table, "parameters", path, wrong)
    scatter = _parameters(table, "scatter", path, wrong)
    whole = not wrong
    goal = table.pop("optimise", None)
    require(goal is None or isinstance(goal, dict), f"{path}: optimise must be a table: write [optimise]")
    known = [*Study.__dataclass_fields__.keys() - {"goal"}, "optimise", "scatter"]
    unknown = sorted(set(table) - set(known))
    own = set(Goal.__dataclass_fields__) - {"scatter"}
    wrong += [f"unknown field {name!r}: {nearest(name, sorted(known))}" for name in unknown]
    wrong += [
        f"optimise: unknown field {name!r}: {nearest(name, sorted(own))}" for name in sorted(set(goal or ()) - own)
    ]
    if goal is None and scatter:
        wrong.append("[[scatter]] belongs to [optimise]: use [[parameters]]")
    if not isinstance(table.get("case"), str):
        wrong.append("case is missing: name the file of the base case")
    given = {name: table[name] for name in table.keys() - {*unknown, "case"}}
    values: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}
    for name in ("speeds_rpm", "torques", "targets"):
        try:
            if name == "targets":
                require(isinstance(values.get(name, {}), dict), "targets must be a table of response = largest value")
                numbers(tuple(values.get(name, {}).values()), name)
            elif name in values:
                values[name] = tuple(map(float, numbers(values[name], name)))
        except InputError as error:
            wrong += mistakes(error)
            del values[name]
    try:
        if whole:
            if goal is not None:
                values["goal"] = Goal(scatter=scatter, **{name: goal[name] for name in own.intersection(goal)})
            study = Study(path.parent / str(table.get("case")), parameters, **values)
    except InputError as error:
        wrong += mistakes(error)
    if wrong:
        raise Mistakes([f"{path}: {text}" for text in dict.fromkeys(wrong)])
    return study


def _parameters(table: dict[str, Any], name: str, path: Path, wrong: list[str]) -> tuple[Parameter, ...]:
    """Return the parameters of a list of tables; mistakes go to `wrong`."""
    raw = table.pop(name, [])
    require(
        isinstance(raw, list) and all(isinstance(one, dict) for one in raw),
        f"{path}: {name} must be tables: write [[{name}]]",
    )
    found = []
    for number, one in enumerate(raw):
        try:
            found.append(parameter_from(one, f"{name}[{number}]"))
        except InputError as error:
            wrong += mistakes(error)
    return tuple(found)
