"""Outcomes of the treatment: change of each measure from the first to the last assessment, by stage and by programme.

Records of restricted patients are counted, because a figure names no patient. Small groups are hidden. If a hidden group could be computed
from the total, the next smallest group of the same kind is also hidden.
"""

import math
from collections import Counter
from collections.abc import Sequence
from datetime import datetime, tzinfo
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from sqlalchemy import Select, String, bindparam, cast, select
from sqlalchemy.orm import Session

from kata.clinic.episodes.tables import EpisodeRow, StageRow
from kata.clinic.programmes.tables import ProgrammeRow
from kata.clinic.statistics import episode_changes, intervals
from kata.clinic.statistics.intervals import SampleSums
from kata.clinic.statistics.measures import MEASURES
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

_STAGES: Final = ("freezing", "frozen", "thawing", "")
_By = Literal["stage", "programme"]


def outcomes(session: Session, span: Span) -> Outcomes:
    """Return the outcomes of the episodes whose last assessment is within the time. The station of ``span`` is ignored."""
    rows = session.connection().execute(_EPISODES, {"since": span.since, "until": span.until}).all()
    measured = episode_changes.unpack(row.changes for row in rows)
    within = (measured["last_at"] >= span.since.timestamp()) & (measured["last_at"] < span.until.timestamp())
    begins = np.where(within, measured["first_at"], np.inf).min(axis=1)
    episodes = _episodes(rows, begins.tolist(), span.zone)
    chosen = [episode.row for episode in episodes]
    changes = _changes(measured[chosen], within[chosen], episodes)
    groups = [_group("all", "", changes)]
    groups += _groups("stage", changes, [episode.stage for episode in episodes], _STAGES)
    groups += _groups("programme", changes, [episode.programme for episode in episodes])
    return Outcomes(
        limits={name: [measure.important, measure.detectable] for name, measure in MEASURES.items()},
        least_patients=LEAST_SHOWN,
        groups=_without_small(groups),
    )


def _episodes_query() -> Select[Any]:
    """Return the query of the episodes that may end within the time, with a row for each stage. Building it takes a tenth of its time."""
    programme = (
        select(ProgrammeRow.name)
        .where(ProgrammeRow.episode_id == EpisodeRow.id)
        .order_by(ProgrammeRow.archived_at.is_(None).desc(), ProgrammeRow.created_at.desc())
        .limit(1)
        .scalar_subquery()
    )
    # Ids are read as text, because making thousands of UUIDs takes longer than the query.
    episode_id, patient_id = (cast(column, String) for column in (EpisodeRow.id, EpisodeRow.patient_id))
    return (
        select(episode_id, patient_id, EpisodeOutcomeRow.changes, StageRow.stage, StageRow.since, programme)
        .join(EpisodeOutcomeRow, EpisodeOutcomeRow.episode_id == EpisodeRow.id)
        .outerjoin(StageRow, StageRow.episode_id == EpisodeRow.id)
        .where(
            EpisodeOutcomeRow.end_at >= bindparam("since", type_=UtcDateTime()),
            EpisodeOutcomeRow.begin_at < bindparam("until", type_=UtcDateTime()),
        )
        .order_by(StageRow.since, StageRow.noted_at)
    )


_EPISODES: Final = _episodes_query()


class _Episode(NamedTuple):
    """By what an episode is grouped."""

    row: int
    """Number of its row."""
    patient: str
    stage: str
    """Stage at the first assessment; empty if none was recorded."""
    programme: str
    """Name of the newest programme; empty if there is none. An archived programme is used only if there is no other."""


def _episodes(rows: Sequence[Any], begins: Sequence[float], zone: tzinfo) -> list[_Episode]:
    """Return the episodes. ``begins``: Unix time of the first assessment for each row; infinite if none ends within the time."""
    episodes: dict[str, _Episode] = {}
    # An episode has a row for each of its stages, the earliest first.
    for number, ((episode_id, patient, _, stage, since, name), begin) in enumerate(zip(rows, begins, strict=True)):
        if begin == math.inf:
            continue
        if since is not None and since <= datetime.fromtimestamp(begin, zone).date():
            episodes[episode_id] = _Episode(number, patient, stage, name or "")
        elif episode_id not in episodes:
            episodes[episode_id] = _Episode(number, patient, "", name or "")
    return list(episodes.values())


_CHANGE: Final = np.dtype(
    [
        # Numbers of the episode, of its patient, and of the measure in MEASURES.
        ("episode", int), ("patient", int), ("measure", int),
        # As in kata.clinic.statistics.episode_changes.
        ("first", float), ("last", float), ("improvement", float), ("weeks", float),
    ]
)  # fmt: skip
"""The change of one measure in an episode, a row of an array. Loops over thousands of changes take longer than the query."""


def _changes(measured: Any, within: Any, episodes: Sequence[_Episode]) -> Any:
    """Return the changes within the time as an array of :data:`_CHANGE`, measure by measure."""
    changed = (within & (measured["last_at"] > measured["first_at"])).T
    measure, episode = np.nonzero(changed)
    changes = np.empty(len(episode), _CHANGE)
    changes["episode"], changes["measure"] = episode, measure
    patients = [of.patient for of in episodes]
    changes["patient"] = _numbers(patients, list(dict.fromkeys(patients)))[episode]
    for name in ("first", "last", "improvement", "weeks"):
        changes[name] = measured[name].T[changed]
    return changes


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
