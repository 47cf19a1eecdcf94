"""Outcomes of the treatment: change of each measure from the first to the last assessment, by stage and by programme.

Records of restricted patients are counted, because a figure names no patient. Small groups are hidden. If a hidden group could be computed
from the total, the next smallest group of the same kind is also hidden.
"""

from collections import Counter
from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from sqlalchemy import Label, Select, String, bindparam, case, cast, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.programmes.tables import ProgrammeRow
from kata.clinic.statistics import intervals
from kata.clinic.statistics.intervals import SampleSums
from kata.clinic.statistics.measures import MEASURES, improvement
from kata.clinic.statistics.schemas import (
    LEAST_SHOWN,
    Estimate,
    OutcomeChange,
    OutcomeGroup,
    OutcomeMeasure,
    Outcomes,
)
from kata.clinic.statistics.tables import EpisodeOutcomeRow
from kata.clinic.statistics.usage import Span
from kata.database.base import UtcDateTime

_WEEK: Final = timedelta(weeks=1)
_STAGES: Final = ("freezing", "frozen", "thawing", "")
_LIMITED: Final = {name for name, measure in MEASURES.items() if measure.important or measure.detectable}
_By = Literal["stage", "programme"]


def outcomes(session: Session, span: Span) -> Outcomes:
    """Return the outcomes of the episodes whose last assessment is within the time. The station of ``span`` is ignored."""
    episodes_by_id = _episodes(session, span)
    episodes = list(episodes_by_id.values())
    changes = _measured_changes(session, span, episodes_by_id)
    groups = [_group("all", "", changes)]
    groups += _groups("stage", changes, [episode.stage for episode in episodes], _STAGES)
    groups += _groups("programme", changes, [episode.programme for episode in episodes])
    return Outcomes(
        limits={name: [measure.important, measure.detectable] for name, measure in MEASURES.items()},
        least_patients=LEAST_SHOWN,
        groups=_without_small(groups),
    )


def _text(column: InstrumentedAttribute[Any]) -> Label[str]:
    """Return ids and times as text. Making thousands of UUIDs and times takes longer than the queries."""
    return cast(column, String).label(column.key)


_WITHIN: Final = (
    EpisodeOutcomeRow.last_at >= bindparam("since", type_=UtcDateTime()),
    EpisodeOutcomeRow.last_at < bindparam("until", type_=UtcDateTime()),
)


def _rows(session: Session, query: Select[Any], span: Span) -> Sequence[Any]:
    """Return the rows of a query with :data:`_WITHIN`."""
    # Rows of the connection cost less than those of the session.
    return session.connection().execute(query, {"since": span.since, "until": span.until}).all()


class _Episode(NamedTuple):
    """By what an episode is grouped."""

    patient: str
    stage: str
    """Stage at the first assessment; empty if none was recorded."""
    programme: str
    """Name of the newest programme; empty if there is none. An archived programme is used only if there is no other."""


def _episodes_query() -> Select[Any]:
    """Return the query of the episodes within the time, with a row for each stage. Building it takes a tenth of its time."""
    first = (
        select(EpisodeOutcomeRow.episode_id, func.min(EpisodeOutcomeRow.first_at).label("first_at"))
        .where(*_WITHIN)
        .group_by(EpisodeOutcomeRow.episode_id)
        .subquery()
    )
    programme = (
        select(ProgrammeRow.name)
        .where(ProgrammeRow.episode_id == EpisodeRow.id)
        .order_by(ProgrammeRow.archived_at.is_(None).desc(), ProgrammeRow.created_at.desc())
        .limit(1)
        .scalar_subquery()
    )
    return (
        select(_text(EpisodeRow.id), _text(EpisodeRow.patient_id), first.c.first_at, StageRow.stage, StageRow.since, programme)
        .join(first, first.c.episode_id == EpisodeRow.id)
        .outerjoin(StageRow, StageRow.episode_id == EpisodeRow.id)
        .order_by(StageRow.since, StageRow.noted_at)
    )  # fmt: skip


_EPISODES: Final = _episodes_query()


def _episodes(session: Session, span: Span) -> dict[str, _Episode]:
    """Return the episodes by id."""
    episodes: dict[str, _Episode] = {}
    # An episode has a row for each of its stages, the earliest first.
    for episode_id, patient, first_at, stage, since, name in _rows(session, _EPISODES, span):
        if since is not None and since <= first_at.astimezone(span.zone).date():
            episodes[episode_id] = _Episode(patient, stage, name or "")
        elif episode_id not in episodes:
            episodes[episode_id] = _Episode(patient, "", name or "")
    return episodes


_CHANGE: Final = np.dtype(
    [
        # Number of the episode, in the order of _episodes, and a number that stands for its patient.
        ("episode", int), ("patient", int),
        # Number of the measure in MEASURES.
        ("measure", int), ("first", float), ("last", float),
        # By how much the value fell, as shown. NaN for a measure without a limit.
        ("improvement", float),
        # Weeks until the first important improvement; NaN if there was none.
        ("weeks", float),
    ]
)  # fmt: skip
"""The change of one measure in an episode, a row of an array. Loops over thousands of changes take longer than the queries."""


_CHANGES: Final = select(
    _text(EpisodeOutcomeRow.episode_id), EpisodeOutcomeRow.measure, EpisodeOutcomeRow.first, EpisodeOutcomeRow.last,
    case((EpisodeOutcomeRow.important_at.is_not(None), _text(EpisodeOutcomeRow.first_at))), _text(EpisodeOutcomeRow.important_at),
).where(*_WITHIN, EpisodeOutcomeRow.last_at > EpisodeOutcomeRow.first_at)  # fmt: skip


def _measured_changes(session: Session, span: Span, episodes: dict[str, _Episode]) -> Any:
    """Return the changes within the time as an array of :data:`_CHANGE`, measure by measure."""
    rows = _rows(session, _CHANGES, span)
    ids, measures, first, last, begins, important = zip(*rows, strict=True) if rows else ((),) * 6
    changes = np.empty(len(rows), _CHANGE)
    changes["episode"] = _numbers(ids, list(episodes))
    patients = [episode.patient for episode in episodes.values()]
    changes["patient"] = _numbers(patients, list(dict.fromkeys(patients)))[changes["episode"]]
    changes["measure"] = _numbers(measures, list(MEASURES))
    changes["first"], changes["last"] = first, last
    changes["improvement"] = [
        improvement(before, after) if measure in _LIMITED else np.nan
        for measure, before, after in zip(measures, first, last, strict=True)
    ]
    changes["weeks"] = [
        (datetime.fromisoformat(at) - datetime.fromisoformat(since)) / _WEEK if at else np.nan
        for since, at in zip(begins, important, strict=True)
    ]
    return changes.take(np.argsort(changes["measure"], kind="stable"))


def _patients(changes: Any) -> int:
    """Return the number of persons. A patient may have an episode of each shoulder."""
    return int(np.count_nonzero(np.bincount(changes["patient"])))


def _numbers(names: Sequence[str], order: Sequence[str]) -> Any:
    """Return the place of each name in ``order``."""
    places = {name: place for place, name in enumerate(order)}
    return np.fromiter(map(places.__getitem__, names), int, len(names))


def _groups(by: _By, changes: Any, names: Sequence[str], order: Sequence[str] = ()) -> list[OutcomeGroup]:
    """Return a group for each name, in this order or else from the largest to the smallest. ``names``: one for each episode."""
    group_names = list(dict.fromkeys((*order, *names)))
    numbers = _numbers(names, group_names)[changes["episode"]]
    counts = np.bincount(numbers, minlength=len(group_names))
    listed = range(len(group_names)) if order else np.argsort(-counts, kind="stable").tolist()
    return [_group(by, group_names[n], changes.compress(numbers == n)) for n in listed if counts[n]]


def _group(by: Literal["all", "stage", "programme"], name: str, changes: Any) -> OutcomeGroup:
    patients = _patients(changes)
    begins = np.searchsorted(changes["measure"], range(1, len(MEASURES)))
    # A small group is hidden, and has no measure that is not.
    shown = [
        _change(measure, of)
        for measure, of in zip(MEASURES, np.split(changes, begins), strict=True)
        if _patients(of) >= LEAST_SHOWN
    ]
    return OutcomeGroup(by=by, name=name, patients=patients, changes=shown)


def _change(measure: OutcomeMeasure, changes: Any) -> OutcomeChange:
    change = changes["last"] - changes["first"]
    limits = MEASURES[measure]
    improved = changes.compress(~np.isnan(changes["weeks"]))
    return OutcomeChange(
        measure=measure,
        patients=_patients(changes),
        shoulders=len(change),
        first=float(changes["first"].mean()),
        last=float(changes["last"].mean()),
        change=intervals.of_mean(SampleSums(len(change), float(change.sum()), float((change**2).sum()))),
        important=_share(changes["improvement"], limits.important, np.greater_equal),
        # As for one patient (kata.clinic.questionnaires.changes): a change that is not larger may be due to chance.
        detectable=_share(changes["improvement"], limits.detectable, np.greater),
        weeks_to_important=[float(quartile) for quartile in np.percentile(improved["weeks"], (25, 50, 75))]
        if _patients(improved) >= LEAST_SHOWN
        else None,
    )


def _share(improvements: Any, limit: float | None, reached: np.ufunc) -> Estimate | None:
    if limit is None:
        return None
    return intervals.of_share(int(np.count_nonzero(reached(improvements, limit))), len(improvements))


def _without_small(groups: list[OutcomeGroup]) -> list[OutcomeGroup]:
    """Hide small groups. A single hidden group could be computed from the total, so the next smallest group is also hidden."""
    hidden = {place for place, group in enumerate(groups) if (group.patients or 0) < LEAST_SHOWN}
    count = Counter(groups[place].by for place in hidden)
    for by in ("stage", "programme"):
        shown_places = [place for place, group in enumerate(groups) if group.by == by and place not in hidden]
        if count[by] == 1 and shown_places:
            hidden.add(min(shown_places, key=lambda place: groups[place].patients or 0))
    empty: dict[str, Any] = {"patients": None, "changes": []}
    return [group.model_copy(update=empty) if place in hidden else group for place, group in enumerate(groups)]
