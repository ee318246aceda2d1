"""Options that decide themselves: a case's `auto` options become on or off by the gearbox's own numbers.

This is the only place where they are decided. docs/decisions/0017-options-decide-themselves.md has the rule.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from nvhchain.case import AUTO, DECIDABLE, LOADED, OFF, ON, Case, GearboxCase, Options
from nvhchain.errors import InputError
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import FloatArray
from nvhchain.levels import number_text
from nvhchain.scene.body_modes import REACH
from nvhchain.scene.linear_level import (
    NO_ERROR,
    LinearGearbox,
    OrderError,
    largest_change,
    level_change,
    spectral_distance,
)

DECIMALS = 3
"""Decimal digits of estimates (dB). Rounding of another machine then decides alike."""

NEGLIGIBLE = 0.07
"""Share of the tolerance below which an option is excluded that takes next to no time: 0.05 dB at `draft`."""

_NARROW = ("gyroscopic", "gear_body_modes")
"""Options that move narrow resonances: what they do to the whole level says little."""

_QUICK = tuple(name for name in DECIDABLE if name != "gear_body_modes")
"""Options that take little time beside mesh laws and a housing; gear bodies need finite elements of their own."""

MESH_OPTIONS = ("friction", "shuttling", "tilt", "gear_body_modes")
"""Options that the mesh level `contact` cannot have."""

IMPOSSIBLE = "cannot be modelled"
"""Begin of the note of an option that the case does not allow."""

UNKNOWN = "no estimate"
"""Begin of the note of an option whose effect is unknown before the run."""


@dataclass(frozen=True)
class OptionEstimate:
    """Estimated effect of one option, on top of all that is modelled.

    option: name of the option.
    asked: `auto`, `on` or `off` by the case, or the name of the case whose statement it follows.
    modelled: True where the run models it.
    level_db: change of the overall level by modelling it (dB).
    distance_db: distance of the spectra with and without it (dB), by which it is decided; of narrow resonances the
    largest change of an order.
    note: reason where there is no estimate; empty where there is one.
    """

    option: str
    asked: str
    modelled: bool
    level_db: float = 0.0
    distance_db: float = 0.0
    note: str = ""

    @property
    def stated(self) -> bool:
        """True where the case itself states it."""
        return self.asked != AUTO

    def line(self, tolerance_db: float) -> str:
        """Return the estimate in words.

        tolerance_db: tolerance of the fidelity (dB).
        """
        outcome = "modelled" if self.modelled else "excluded"
        how = f"{outcome} by the case" if self.stated else outcome
        if self.note:
            return f"{self.option} {how}: {self.note}"
        effect = f"{number_text(self.level_db, '+.1f')} dB"
        if self.distance_db - abs(self.level_db) > 0.05:
            what = "one order" if self.option in _NARROW else "its orders"
            effect += f", {what} by {self.distance_db:.1f} dB"
        if self.stated and not self.modelled and self.distance_db > tolerance_db:
            return f"{self.option} {how}, would change the sound: {effect}"
        return f"{self.option} {how}: {effect}"


@dataclass(frozen=True)
class Modelling:
    """Options of a case after the decision, each with its estimate.

    case: case without `auto`.
    tolerance_db: largest distance (dB) of the chosen model's spectrum from that with all options that were open.
    options: options in the order of `DECIDABLE`.
    excluded_db: level of the model with all open options over that of the chosen model (dB).
    excluded_distance_db: distance of their spectra (dB).
    excluded_error: relative change of amplitudes by what is excluded; of single orders at constant speed.
    """

    case: GearboxCase
    tolerance_db: float
    options: tuple[OptionEstimate, ...]
    excluded_db: float = 0.0
    excluded_distance_db: float = 0.0
    excluded_error: OrderError = NO_ERROR

    def __repr__(self) -> str:
        return f"Modelling({self.case.name}; {'; '.join(self.lines)})"

    @property
    def lines(self) -> tuple[str, ...]:
        """Every option with its estimate, in words."""
        return tuple(each.line(self.tolerance_db) for each in self.options)

    @property
    def disputed(self) -> tuple[OptionEstimate, ...]:
        """Options that the case excludes by hand though their estimate exceeds the tolerance."""
        return tuple(
            each for each in self.options if each.stated and not each.modelled and each.distance_db > self.tolerance_db
        )

    @property
    def sentences(self) -> tuple[str, ...]:
        """Decision in words, and options that the case excludes against their estimate."""
        auto = [each for each in self.options if not each.stated]
        found = []
        if auto:
            on = ", ".join(f"{each.option} {number_text(each.level_db, '+.1f')} dB" for each in auto if each.modelled)
            never, unknown = (
                [each.option for each in auto if each.note.startswith(begin)] for begin in (IMPOSSIBLE, UNKNOWN)
            )
            off = ", ".join(each.option for each in auto if not each.modelled and each.option not in never + unknown)
            parts = [f"modelled: {on or 'no option'}"]
            parts += [f"excluded: {off}, in all {number_text(self.excluded_db, '+.1f')} dB"] if off else []
            parts += (
                [f"excluded with {UNKNOWN}, which no limits count: {', '.join(unknown)} (see plan)"] if unknown else []
            )
            parts += [f"{IMPOSSIBLE}: {', '.join(never)} (see plan)"] if never else []
            found.append("; ".join(parts))
        return (*found, *(each.line(self.tolerance_db) for each in self.disputed))

    def estimated_at(self, case: GearboxCase) -> Modelling:
        """Return the decision with the error of what it excludes, estimated at the speed and torque of a case.

        case: case without `auto`, with the options that are modelled.
        """
        left = [each.option for each in self.options if not (each.stated or each.note or each.modelled)]
        if case.operation.input_torque <= 0.0:
            left = [name for name in left if name not in LOADED]
        linear, full = _Estimates(case), replace(case.options, **_switched_on(left))
        try:
            far, error = linear.distance(case.options, full), linear.order_changes(case.options, full)
        except InputError:  # no estimate in this state
            return self
        return replace(self, excluded_distance_db=far, excluded_error=error)

    def values(self) -> dict[str, Any]:
        """Return the decision for JSON files."""
        return {
            "tolerance_db": self.tolerance_db,
            "excluded_db": self.excluded_db,
            "excluded_distance_db": self.excluded_distance_db,
            "sentences": list(self.sentences),
            "options": [
                {
                    "option": each.option,
                    "asked": each.asked,
                    "modelled": each.modelled,
                    **({"note": each.note} if each.note else _decibels(each)),
                }
                for each in self.options
            ],
        }


def _decibels(estimate: OptionEstimate) -> dict[str, float]:
    return {"level_db": estimate.level_db, "distance_db": estimate.distance_db}


def decided(case: Case, fidelity: Fidelity) -> Case:
    """Return a case without `auto`.

    fidelity: fidelity of the run; its `option_tolerance_db` decides.
    Returns the case itself where nothing is open.
    """
    if not isinstance(case, GearboxCase) or not case.options.undecided:
        return case
    return modelled(case, fidelity).case


def plain(case: Case) -> Case:
    """Return a case whose `auto` is off, for a run without dynamics."""
    if not isinstance(case, GearboxCase) or not case.options.undecided:
        return case
    return replace(case, options=replace(case.options, **{name: OFF[name] for name in case.options.undecided}))


def modelled(case: GearboxCase, fidelity: Fidelity) -> Modelling:
    """Decide the options of a case.

    Returns case without `auto`, and the estimate of every option.

    The start is the model with all open options. Of these, the one with the smallest effect is excluded, and again, as
    long as the spectrum stays within the tolerance of the start. What is excluded in all is therefore below it. An
    option that takes next to no time stays unless it hardly acts: excluded, it would widen the limits for nothing.
    """
    return _modelled(case, fidelity.option_tolerance_db, _solves_contact(fidelity))


def modelled_alike(
    cases: Sequence[Case],
    fidelity: Fidelity,
    speeds: Sequence[float] | None = None,
    torques: Sequence[float] | None = None,
) -> dict[str, Modelling]:
    """Decide the options of cases that are compared, or of steady states of one case, alike for all.

    speeds: further steady speeds of the input (rad/s).
    torques: torques of the input (N m) at these speeds; those of the cases by default.

    Returns name of every gearbox → its modelling.

    An open option follows the cases that state it. If none does, it is on where one of the cases needs it, at its own
    speed or at one of the others. Differences of the cases, or over speed and torque, are then none of their models.
    """
    gearboxes = [case for case in cases if isinstance(case, GearboxCase)]
    alone = {case.name: modelled(case, fidelity) for case in gearboxes}
    if (len(gearboxes) < 2 and not speeds) or not any(case.options.undecided for case in gearboxes):
        return alone
    needed = {
        case.name: [
            alone[case.name].case.options,
            *_needed(
                case,
                fidelity.option_tolerance_db,
                tuple(speeds or ()),
                None if torques is None else tuple(torques),
                _solves_contact(fidelity),
            ),
        ]
        for case in gearboxes
    }
    common, source = dict[str, Any](), dict[str, str]()
    for name in DECIDABLE:
        stated = [case for case in gearboxes if getattr(case.options, name) != AUTO]
        values = [getattr(options, name) for case in stated or gearboxes for options in needed[case.name]]
        common[name] = max(values)
        source |= {name: stated[0].name} if stated else {}
    return {case.name: _alike(case, common, source, fidelity) for case in gearboxes}


@lru_cache(maxsize=64)
def _needed(
    case: GearboxCase,
    tolerance: float,
    speeds: tuple[float, ...],
    torques: tuple[float, ...] | None,
    solves_contact: bool,
) -> tuple[Options, ...]:
    """Return the options that a case needs at steady speeds (rad/s), for each torque (N m)."""
    if not speeds or not case.options.undecided:
        return ()
    found = []
    for load in (case.operation.input_torque,) if torques is None else torques:
        with suppress(InputError):  # a state that the case refuses has no level
            state = replace(case, operation=replace(case.operation, input_torque=float(load)))
            found.append(_chosen(_Estimates(state, speeds, solves_contact), tolerance, _quick(case))[0])
    return tuple(found)


def _alike(case: GearboxCase, common: Mapping[str, Any], source: Mapping[str, str], fidelity: Fidelity) -> Modelling:
    """Return the modelling of a case whose open options take common values where they can."""
    linear, tolerance = _estimates(case, _solves_contact(fidelity)), fidelity.option_tolerance_db
    chosen = linear.plain(**{name: common[name] for name in linear.open})
    asked = {name: source.get(name, AUTO) for name in case.options.undecided}
    return _described(linear, chosen, linear.plain(**_switched_on(linear.open)), tolerance, asked)


@lru_cache(maxsize=256)
def _modelled(case: GearboxCase, tolerance: float, solves_contact: bool) -> Modelling:
    linear = _estimates(case, solves_contact)
    chosen, full = _chosen(linear, tolerance, _quick(case))
    return _described(linear, chosen, full, tolerance, dict.fromkeys(case.options.undecided, AUTO))


def _chosen(linear: _Estimates, tolerance: float, quick: Collection[str] = ()) -> tuple[Options, Options]:
    """Return the options that are modelled, and all that could be.

    quick: options that take next to no time, which are excluded only if they hardly act.

    Options may hide each other: one that exceeds its tolerance on top of those that remain comes back.
    """
    names = linear.open
    limit = {name: tolerance * (NEGLIGIBLE if name in quick else 1.0) for name in names}
    left = list(names)
    full = chosen = linear.plain(**_switched_on(left))
    while left:
        reduced = {name: chosen.switched(name, modelled=False) for name in left}
        far = {name: linear.effect(name, options, full) for name, options in reduced.items()}
        small = [name for name in left if far[name] <= limit[name]]
        if not small:
            break
        name = min(small, key=lambda each: (far[each], each))
        left.remove(name)
        chosen = reduced[name]
    while outside := [name for name in names if not chosen.models(name)]:
        far = {name: linear.effect(name, chosen, chosen.switched(name, modelled=True)) for name in outside}
        missed = [name for name in outside if far[name] > limit[name]]
        if not missed and linear.distance(chosen, full) <= tolerance:
            break
        name = max(missed or outside, key=lambda each: (far[each], each))
        chosen = chosen.switched(name, modelled=True)
    return chosen, full


def _quick(case: GearboxCase) -> tuple[str, ...]:
    """Return the options that take next to no time; none in a run-up, or over whole turns of gears with deviations."""
    return _QUICK if case.ramp is None and not any(case.deviations) else ()


def _described(
    linear: _Estimates, chosen: Options, full: Options, tolerance: float, asked: Mapping[str, str]
) -> Modelling:
    """Return the modelling with the estimate of every option on top of the chosen ones."""
    found = []
    for name in DECIDABLE:
        on, stated = chosen.models(name), "on" if linear.case.options.models(name) else "off"
        note, level, distance = linear.refusal(name), 0.0, 0.0
        excluded, included = (chosen.switched(name, modelled=value) for value in (False, True))
        if not note:
            try:
                level, distance = linear.change(excluded, included), linear.effect(name, excluded, included)
            except InputError as error:  # of an option that the case excludes, beside those chosen
                note = f"{IMPOSSIBLE}: {error}"
        found.append(OptionEstimate(name, asked.get(name, stated), on, level, distance, note))
    case = replace(linear.case, options=chosen) if linear.case.options != chosen else linear.case
    left, far = linear.change(chosen, full), linear.distance(chosen, full)
    return Modelling(case, tolerance, tuple(found), left, far, linear.order_changes(chosen, full))


def _farthest(
    before: FloatArray, after: FloatArray, measure: Callable[[FloatArray, FloatArray], float] = spectral_distance
) -> float:
    """Return the largest distance (dB), by a measure, of spectra (n_speed, n_order) that are heard at all."""
    heard = (before.sum(axis=1) > 0.0) & (after.sum(axis=1) > 0.0)
    pairs = zip(before[heard, None], after[heard, None], strict=True)
    return max((measure(*each) for each in pairs), default=0.0)


@lru_cache(maxsize=16)
def _estimates(case: GearboxCase, solves_contact: bool) -> _Estimates:
    """Return the spectra of a case, which a comparison takes again."""
    return _Estimates(case, solves_contact=solves_contact)


def _solves_contact(fidelity: Fidelity) -> bool:
    """Return True where the contact problem is solved in every step, which has no options of the meshes."""
    return fidelity.dynamics.mesh_level == "contact"


def _switched_on(names: Sequence[str]) -> dict[str, Any]:
    return {name: ON[name] for name in names}


class _Estimates:
    """Spectra of a linear gearbox by options, each computed once.

    speeds: steady speeds of the input (rad/s) in place of the case's own.
    solves_contact: True for the mesh level `contact`.
    """

    def __init__(self, case: GearboxCase, speeds: tuple[float, ...] = (), solves_contact: bool = False) -> None:
        self.case, self._linear, self._solves_contact = case, LinearGearbox(case, speeds), solves_contact
        self._powers = dict[Options, FloatArray]()
        self._refusals = dict[str, str]()

    @property
    def open(self) -> list[str]:
        """Options that are `auto` and that the gearbox can have beside those that the case states."""
        return [name for name in self.case.options.undecided if not self.refusal(name)]

    def plain(self, **on: Any) -> Options:
        """Return the case's options with those that are open off, except the values `on`."""
        return replace(self.case.options, **({name: OFF[name] for name in self.case.options.undecided} | on))

    def power(self, options: Options) -> FloatArray:
        if options not in self._powers:
            self._powers[options] = self._linear.power(options)
        return self._powers[options]

    def refusal(self, name: str) -> str:
        """Return the reason why an option has no estimate; empty where it has one."""
        if name not in self._refusals:
            self._refusals[name] = self._refused(name)
        return self._refusals[name]

    def _refused(self, name: str) -> str:
        torque = self.case.operation.input_torque
        if torque == 0.0:
            return f"{UNKNOWN}, since idle gears have no mean load"
        if self._solves_contact and name in MESH_OPTIONS:
            return f"{IMPOSSIBLE}: mesh_level = contact solves the contact of gears that stand straight, without it"
        if torque < 0.0 and name in LOADED:
            return f"acts on drive flanks under load, but input_torque = {torque:g} N m"
        if name == "gear_body_modes" and not self._linear.gear_bodies:
            return f"no gear body has modes up to {REACH * self.case.band.high:.4g} Hz"
        try:
            power = self.power(self.plain(**_switched_on([name])))
            if name == "gear_body_modes":  # beside all others, too: the choice begins with all of them
                open_ones = [each for each in self.case.options.undecided if each != name]
                others = [each for each in open_ones if not self.refusal(each)]
                self.power(self.plain(**_switched_on([*others, name])))
        except InputError as error:
            return f"{IMPOSSIBLE}: {error}"
        return "" if float(np.sum(power)) > 0.0 else f"{UNKNOWN}, since no mesh order lies in the band"

    def change(self, before: Options, after: Options) -> float:
        return self._compared(level_change, before, after)

    def distance(self, before: Options, after: Options) -> float:
        """Return the distance of the spectra (dB); of steady speeds the largest."""
        return self._compared(_farthest if self._linear.steady else spectral_distance, before, after)

    def effect(self, name: str, before: Options, after: Options) -> float:
        """Return the effect of an option (dB): the distance of the spectra; of narrow resonances the largest change."""
        if name not in _NARROW:
            return self.distance(before, after)
        measure = partial(_farthest, measure=largest_change) if self._linear.steady else largest_change
        return max(self.distance(before, after), self._compared(measure, before, after))

    def order_changes(self, before: Options, after: Options) -> OrderError:
        """Return the relative change of amplitudes; of single orders at one speed alone."""
        mean = 10.0 ** (self.distance(before, after) / 20.0) - 1.0
        if before == after or len(self._linear.speeds) > 1:
            return OrderError((), mean)
        first, second = self.power(before)[0], self.power(after)[0]
        heard = np.maximum(first, second) > 0.0
        change = np.abs(np.sqrt(second[heard] / np.maximum(first[heard], 1e-300)) - 1.0)
        change = np.maximum(change, mean)  # where an order's own estimate is small by chance
        return OrderError.rounded(self._linear.orders[heard], change, mean)

    def _compared(self, measure: Any, before: Options, after: Options) -> float:
        if before == after:
            return 0.0
        return round(measure(self.power(before), self.power(after)), DECIMALS)
