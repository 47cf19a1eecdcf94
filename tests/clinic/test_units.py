"""Every number in an answer, an export, a report and a text has a unit; every number of a body also has a side and a time."""

import json
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, get_args

import pytest
from sqlalchemy import Boolean, Float, Integer

from kata.clinic import tables
from kata.clinic.assessments.rom import KINDS, MEASURES
from kata.clinic.progress import figures, numbers
from kata.clinic.progress.series import (
    PAIN_CONTEXTS,
    PAIN_IN_SESSIONS,
    Chart,
    EndFeelPoint,
    EndRangeGain,
    EndRangePoint,
    LineSeries,
    Point,
    QuestionnairePanel,
    RomLine,
    RomPanel,
    SpadiPoint,
    TotalPoint,
    Tracked,
)
from kata.clinic.questionnaires.definitions import DEFINITIONS
from kata.database.base import Base
from kata.database.engine import Database
from kata.interop import sample_table
from kata.messages import Text
from kata.reporting.phrases import PHRASES
from tests.support.databases import SQLITE_FIRST
from tests.support.fhir_bundle import Json, everything, exported, of_kind
from tests.support.fhir_patient import treated
from tests.support.paths import ROOT
from tests.support.service import api_document
from tests.support.units import COUNT, ORDINAL, SUFFIXES, is_of_a_body, unit_of

TEMPLATES: Final = ROOT / "backend/kata/reporting/templates"
LOCALES: Final = ROOT / "frontend/src/locales"


# -- answers of the API ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def answers() -> dict[str, Json]:
    """Return every schema that an answer contains, by name."""
    document = api_document()
    schemas: dict[str, Json] = document["components"]["schemas"]
    found: set[str] = set()
    waiting = [
        name
        for operations in document["paths"].values()
        for operation in operations.values()
        for name in _references(operation["responses"])
    ]
    while waiting:
        if (name := waiting.pop()) not in found:
            found.add(name)
            waiting += _references(schemas[name])
    return {name: schemas[name] for name in sorted(found)}


def _references(part: Any) -> list[str]:
    return [element["$ref"].rpartition("/")[2] for element in everything(part) if isinstance(element.get("$ref"), str)]


def _is_number(field: Json) -> bool:
    inner = [
        *field.get("anyOf", []),
        *field.get("prefixItems", []),
        field.get("items"),
        field.get("additionalProperties"),
    ]
    return field.get("type") in ("number", "integer") or any(
        _is_number(schema) for schema in inner if isinstance(schema, dict)
    )


def _numbers(answers: dict[str, Json]) -> Iterator[tuple[str, str]]:
    for name, schema in answers.items():
        for field, number_schema in schema.get("properties", {}).items():
            if _is_number(number_schema):
                yield name, field


OF_A_MEASURE: Final = "in the unit of the measure beside it"
NOT_A_VALUE: Final = {
    "TextKey.params": "the numbers of a text, whose unit is in the text (test_every_number_of_a_text_has_a_unit)",
    "PlacedText.params": "as TextKey.params",
    "ProgressTable.rows": "cells; the columns' names have the units (test_progress_columns_have_units)",
    **dict.fromkeys(("Estimate.value", "Estimate.low", "Estimate.high"), "in the unit of the field that holds it"),
    **dict.fromkeys(
        ("OutcomeChange.first", "OutcomeChange.last", "PatientChange.before", "PatientChange.now", "Outcomes.limits"),
        OF_A_MEASURE,
    ),
    **dict.fromkeys(
        [f"AcceptedValues.{name}" for name in ("low", "high", "choices", "step", "none")],
        "in the unit of the field that holds it",
    ),
    "Figure.data": "a Plotly figure; its axes have the units",
    "Figure.layout": "a Plotly figure",
}


def test_every_number_in_an_answer_has_a_unit(answers: dict[str, Json]) -> None:
    known = [(name, field) for name, field in _numbers(answers) if f"{name}.{field}" not in NOT_A_VALUE]
    assert len(known) > 150
    assert [f"{name}.{field}" for name, field in known if unit_of(field) is None] == []


NOBODYS: Final = {
    "AssessmentForm": "thresholds of a questionnaire",
    "OutcomeChange": "means of many patients",
    "Outcomes": "limits of the measures",
    "Questionnaire": "a definition",
    "ChangeThreshold": "a definition",
    "RomMeasure": "bounds and reference of a measurement",
    "AxisInfo": "the apparatus' own ranges",
    "StationInfo": "the apparatus' own ranges",
    "StageProposal": "a proposal of a stage",
    "StationDrift": "the tracking error of an apparatus",
    "StationTracking": "the tracking error of an apparatus",
    "MotorCondition": "friction and play of a motor of the apparatus",
    "MotorStepResponse": "the response of a motor of the apparatus",
    "StepFigures": "the response of a motor of the apparatus",
    "SimulatorState": "the effort of a simulated patient",
}
"""Schemas whose angles and scores belong to no patient."""
TIMELESS: Final = {
    "UnderstoodMotion": "the file that is being imported now",
    "MotionPreview": "the motion of a recording or programme that the address names",
    "MotionLimit": "valid while the episode is open",
    "SoundMotion": "its recording has the time at which it was taught",
}


@pytest.mark.parametrize(("what", "exempt"), [("side", NOBODYS), ("time", NOBODYS | TIMELESS)])
def test_every_number_of_a_body_has_side_and_time(answers: dict[str, Json], what: str, exempt: Json) -> None:
    """Return True if the schema has it, refers by an id to a record that has it, or is contained only in schemas that have it."""
    owners = {name: [owner for owner, schema in answers.items() if name in _references(schema)] for name in answers}

    def has(name: str) -> bool:
        fields = answers[name].get("properties", {})
        if what == "side" and "side" in fields:
            return True
        if what == "time" and (
            "age_ms" in fields or any("date-time" in json.dumps(number_schema) for number_schema in fields.values())
        ):
            return True
        return any(
            f"{record}_id" in fields and has(record.capitalize()) for record in ("episode", "session", "recording")
        )

    def resolved(name: str, seen: frozenset[str] = frozenset()) -> bool:
        if name in exempt or has(name):
            return True
        above = [owner for owner in owners[name] if owner not in seen and not owner.startswith("Page")]
        return bool(above) and all(resolved(owner, seen | {name}) for owner in above)

    of_a_body = sorted(
        {
            name
            for name, field in _numbers(answers)
            if is_of_a_body(field) or NOT_A_VALUE.get(f"{name}.{field}") == OF_A_MEASURE
        }
    )
    assert len(of_a_body) > 10
    assert [name for name in of_a_body if not resolved(name)] == []


# -- exports --------------------------------------------------------------------------------------------------------


def test_columns_of_exported_tables_have_units() -> None:
    """``patient.json``, ``sessions.json``, ``recordings.csv`` and ``runs.csv`` have every column of these tables."""
    exported_rows: tuple[type[Base], ...] = (
        tables.EpisodeRow, tables.ProgrammeVersionRow, tables.ProgrammeItemRow, tables.AssessmentRow, tables.RomRow,
        tables.SessionRow, tables.RecordingRow, tables.RunRow, tables.MotorTrackingRow, tables.MotionTrackingRow,
        tables.GoniometerReadingRow, tables.EndFeelRow,
    )  # fmt: skip
    columns = [
        column
        for row in exported_rows
        for column in row.__table__.columns
        if isinstance(column.type, Integer | Float) and not isinstance(column.type, Boolean)
    ]
    assert len(columns) > 50
    assert [str(column) for column in columns if unit_of(column.name) is None] == []


def test_columns_of_samples_have_their_unit() -> None:
    for name, unit in (*sample_table._RECORDING_COLUMNS.values(), *sample_table._RUN_COLUMNS.values()):
        assert unit.lower() == name.rpartition("_")[2], name


@SQLITE_FIRST
def test_fhir_quantities_have_unit_side_and_time(database: Database, tmp_path: Path) -> None:
    bundle = exported(database, treated(database, sessions=2), tmp_path / "bundle.json")
    quantities = [element for element in everything(bundle) if isinstance(element.get("value"), int | float)]
    assert len(quantities) > 60
    assert [quantity for quantity in quantities if not {"unit", "system", "code"} <= set(quantity)] == []
    measured = of_kind(bundle, "Observation")
    assert {"valueQuantity", "valueString"} <= {name for observation in measured for name in observation}
    assert [observation["code"] for observation in measured if "bodySite" not in observation] == []
    assert [
        observation["code"]
        for observation in measured
        if not {"effectiveDateTime", "effectivePeriod"} & set(observation)
    ] == []
    plain = [part for part in everything(bundle) if "valueInteger" in part]
    counted = {"run-repetitions"}
    for part in plain:
        code = part.get("code", {}).get("coding", [{}])[0].get("code", "")
        assert code in counted or "url" in part or set(part) == {"valueInteger"}, part


# -- reports --------------------------------------------------------------------------------------------------------

COUNTED_HEADS: Final = {
    "run": ORDINAL, "number": ORDINAL, "motor": ORDINAL, "planned": COUNT, "done": COUNT, "stops": COUNT, "in_sessions": COUNT,
}  # fmt: skip
"""Heads of columns with counts and places, which have no unit."""
HEADED_BY_CAPTION: Final = {
    "baseline": ("rom_caption", "pain_scores", "questionnaire_scores"), "newest": ("rom_caption", "pain_scores", "questionnaire_scores"),
    "pain_before": ("pain", "repetitions_note"), "pain_after": ("pain", "repetitions_note"), "pain_during": ("pain",),
    "change": ("rom_caption", "pain_scores", "questionnaire_scores"), "other_side": ("rom_caption",), "reference": ("rom_caption",),
}  # fmt: skip
"""Heads whose unit is in the caption or heading of each of their tables."""
TEXT_HEADS: Final = {
    "stage", "since", "motion", "kind", "date", "cause", "check", "time", "confirmed", "recording", "settings", "outcome", "therapist",
    "signed_column", "pain_change", "questionnaire", "meaning", "contraindications", "note", "noted", "permission", "resolved", "goniometer_by",
    # Values of a station's configuration, whose name in the row has the unit.
    "commissioning_step", "result", "value", "value_before", "value_after",
    "dose_counts", "dose_monday",
}  # fmt: skip
_UNIT: Final = re.compile(
    r"°|\bdeg|\bNm\b|\bms\b|, s\b|, min\b|\(分\)|%|\bHz\b|秒|度|\b0\b.*\b10\b|points|点|0.*〜 ?10|\b0\b.*100",
    re.IGNORECASE,
)


def test_columns_of_reports_have_units() -> None:
    heads = {
        key
        for template in TEMPLATES.glob("*.html")
        for line in template.read_text().splitlines()
        if "heads([" in line or "<thead>" in line
        for key in re.findall(r'phrase\("(\w+)"', line)
    }
    assert len(heads) > 25
    assert not TEXT_HEADS & COUNTED_HEADS.keys()
    for key in sorted(heads - TEXT_HEADS - COUNTED_HEADS.keys()):
        for place in (0, 1):
            stated = [PHRASES[phrase][place] for phrase in HEADED_BY_CAPTION.get(key, (key,))]
            assert all(_UNIT.search(words) for words in stated), (key, stated)


REPORT_NUMBERS: Final = {
    "percent": r"%", "seconds": r"s\b|秒", "minutes": r"min|分", "rate": r"Hz", "speed": r"°/s", "years": r"years|歳",
    "least": r"points|点", "most": r"points|点", "detectable": r"points|点",
    **dict.fromkeys(("lowest", "highest"), r"points|点"), **dict.fromkeys(("low", "low_u", "high", "high_u"), "°"),
    # Counts and places: the words beside them name the counted thing.
    "count": r"\w{3}|回", "planned": r"\w{3}", "done": r"\w{3}", "number": r"\w{2}", "numbers": r"\w{3}", "version": r"version|版|Kata",
    "level": r"level|レベル", "band": "°", "torque": "Nm", "effort": "Nm", "work": "J",
}  # fmt: skip
"""Numbers in the sentences of reports, and what must be in the same sentence."""
REPORT_WORDS: Final = {"first", "last", "moment", "motion", "name", "start", "title", "source", "counted", "prescribed"}
"""Parameters that are no numbers, are formatted with their unit before, or stand in a column whose head has the unit."""


def test_numbers_in_sentences_of_reports_have_units() -> None:
    for key, words in PHRASES.items():
        for text in words:
            for name in re.findall(r"\{(\w+)[^}]*\}", text):
                if name in REPORT_WORDS:
                    continue
                rest = re.sub(r"\{[^}]*\}", "", text)
                assert re.search(REPORT_NUMBERS[name], rest), (key, text)


# -- progress -------------------------------------------------------------------------------------------------------

COUNTED_COLUMNS: Final = {"Playbacks", "Sessions", "As prescribed", "Repetitions planned", "Repetitions done"}


def test_progress_columns_have_units() -> None:
    made = [
        numbers.rom([]), numbers.pain([LineSeries(name, ()) for name in PAIN_CONTEXTS]), numbers.spadi([]),
        numbers.questionnaires([]), numbers.tracking([]), numbers.correction([]), numbers.adherence([]),
    ]  # fmt: skip
    columns = [column.name for table in made for column in table.columns if column.kind == "number"]
    assert len(columns) > 12
    assert [name for name in columns if name not in COUNTED_COLUMNS and not _UNIT.search(name)] == []


# -- hover texts ----------------------------------------------------------------------------------------------------

_HOVERED: Final = r"%{[xy]:\.(\d)~?f}"
_HOVERED_UNIT: Final = re.compile(_HOVERED + r" ?(?:deg|°|points|点|Nm|min|分|%|s\b)")


def _progress_figures() -> dict[str, Json]:
    """Return a figure of every chart, drawn from a value of each kind."""
    at = datetime(2026, 3, 2, 9, 30, tzinfo=UTC)
    point = Point(at, 0.0, 12.5)
    flexion = next(measure for measure in MEASURES if measure.motion == "flexion")
    panels = [RomPanel(flexion, tuple(RomLine(kind, (point,), 140.5) for kind in KINDS))]
    return {
        "rom": figures.rom(panels),
        "pain": figures.pain([LineSeries(name, (point,)) for name in (*PAIN_CONTEXTS, *PAIN_IN_SESSIONS)]),
        "spadi": figures.spadi([SpadiPoint(at, 0.0, 43.125, 50.0, 36.25)]),
        "questionnaires": figures.questionnaires([QuestionnairePanel(DEFINITIONS["quickdash"], (TotalPoint(at, 0.0, 29.5),))]),
        "tracking": figures.tracking([Tracked("Lift", "smooth", at, 0.0, 1, 0.5, 1.5)]),
        "correction": figures.correction([LineSeries("Lift", (point,))]),
        "end_feel": figures.end_feel([EndFeelPoint("Flexion", "left", at, 0.0, 2.0, 80.5, 0.5, 60.0, 0.1)]),
        "end_range": figures.end_range(EndRangeGain((EndRangePoint("Flexion", at, 0.0, 1.5, 1.5),), (LineSeries("Flexion", (point,)),))),
        "adherence": figures.adherence([]),
    }  # fmt: skip


def test_hover_texts_of_progress_have_units_and_decimals() -> None:
    """A hovered value has as many decimals as the table of its chart, because a limit of a questionnaire is close to a value."""
    charts = _progress_figures()
    assert set(charts) == set(get_args(Chart))
    japanese = json.loads((LOCALES / "ja/server.json").read_text())
    wrong = []
    # Its values are numbers of sessions.
    del charts["adherence"]
    for chart, figure in charts.items():
        for trace in figure["data"]:
            template = trace["hovertemplate"]
            code = template.key.code if isinstance(template, Text) else ""
            for text in (str(template), str(japanese.get(code, "")).replace("{{", "{").replace("}}", "}")):
                scale = re.search(r"%{y}(?: of 10|／10)", text)
                decimals = _HOVERED_UNIT.search(text)
                if not scale and not (decimals and int(decimals[1]) > 0):
                    wrong.append(f"{chart}, {trace['name']}: {text!r}")
    assert wrong == []


def test_hover_texts_of_the_page_have_units() -> None:
    found = [
        (path.name, line)
        for path in sorted((ROOT / "frontend/src").rglob("*.ts"))
        for line in path.read_text().splitlines()
        if "hovertemplate:" in line and re.search(r"%{[xy]:\.", line)
    ]
    assert len(found) > 4
    # A name in braces comes from the catalogue and contains the unit, like the title of the axis.
    assert [one for one in found if not (_HOVERED_UNIT.search(one[1]) or "${" in one[1])] == []


# -- texts of the page and of the service ---------------------------------------------------------------------------

_VALUE: Final = r"\s?\{\{%s[^}]*\}\}"
TEXT_NUMBERS: Final[dict[str, str]] = {
    # The unit follows, also after a range.
    **dict.fromkeys(("angle", "counted", "highest", "lowest", "margin", "limit"), r"{}(?: (?:to|and) \{\{\w+\}\}| *〜 *\{\{\w+\}\})? ?(?:°|deg|degrees|度)|level {}|レベルの上限は{}|{}(?:から|〜)"),
    "percent": r"{} ?%", "ms": r"{} ?(?:ms|ミリ秒)", "hz": r"{} ?Hz", "degPerSecond": r"{} ?(?:deg/s|°/s)|毎秒{}°",
    "seconds": r"{} ?(?:s\b|秒)", "offset": r"{} ?(?:s\b|秒)", "minutes": r"{} ?(?:min|分)", "age": r"{} ?(?:years|歳)",
    "leastNm": r"{} to \{\{mostNm\}\} Nm|{}〜\{\{mostNm\}\} Nm", "mostNm": r"{} Nm", "length": r"{} ?(?:s\b|秒)", "speed": r"{} ?%", "range": r"{} ?%",
    # Scores.
    "tScore": r"50", "total": r"100|\{\{highestTotal\}\} ?(?:points|点)", "pain": r"100|", "disability": r"100",
    **dict.fromkeys(("least", "most", "detectable"), r"points|点|段階|level|レベル|of \{\{most|/ ?\{\{most|\{\{most\}\}(?:[:：]|はモータの定格)"),
    # Counts and places: a word names the counted thing.
    **dict.fromkeys(
        ("count", "rows", "samples", "number", "version", "times", "take", "step", "place", "level", "levels", "repetitions", "motor",
         "sessions", "wished", "planned", "position"), r"[^\W\d_]{2}|\. |^, |[行回個件段位番]"
    ),
    # End-range time, stretches, end-feel tests, self-paced playbacks and the clinic's figures.
    **dict.fromkeys(("band", "half", "onset", "uncertainty", "end", "largest"), r"{} ?°"), "stiffness": r"{} ?Nm/°", "work": r"{} ?J",
    **dict.fromkeys(("torque", "effort", "threshold", "target"), r"{}\s?Nm|{}(?: of |／)\{\{target\}\} ?Nm"),
    "category": r"(?:category |カテゴリ){}", "selected": r"rows?\b|件", "hold": r"{} ?(?:s|秒)", "shortest": r"{}(?: to |〜)\{\{seconds\}\} ?(?:s|秒)", "hours": r"{} ?(?:h\b|時間)|hours: {}|時間：{}",
    "days": r"{} ?(?:days|日)|^{}[.。]", "median": r"{} ?(?:weeks|週)", "limit_points": r"{} ?(?:points|点)", "now": r"100|10",
    **dict.fromkeys(("low", "high"), r"(?:to|〜)\s?\{\{high\}\} ?(?:%|°|weeks|週)|95"), "highestTotal": r"{} ?(?:points|点)",
    **dict.fromkeys(("held", "prescribed", "overdue", "programmes", "presses", "stopped", "confirmed"), r"sessions|programmes|instructions|confirmed|回|件|項目|セッション|プログラム|指示"),
}  # fmt: skip
"""Numbers in the texts of the page by their parameter, and the pattern of the text; ``{}`` is the number."""
FORMATTED: Final = {"duration", "fault", "goal", "lasts", "left", "span", "played", "before", "after", "from", "to", "value", "at", "done", "week", "min", "max",
                    "of", "missed", "runs", "items", "given", "changed", "change", "lead", "elevation", "scapula", "size", "values", "ratio",
                    "deviation", "pains", "settings", "drift", "differences", "verdict"}  # fmt: skip
"""Parameters that hold a text, or a number that a text of this list formats with its unit (``programmes:played.percent``), and the ratio of
the shoulder rhythm, which has no unit.
"""
WORDS: Final = {
    "address", "agent", "button", "by", "cause", "changes", "chart", "check", "choices", "chosen", "closed", "columns",
    "contraindications", "day", "diagnosis", "digest", "doctor", "due", "during", "effect", "endRange", "ended", "explanation", "mode", "torqueState",
    "fault", "file", "first", "fixtures", "folder", "gain", "groups", "help", "identifiers", "item", "kana", "key", "kind", "kinds",
    "label", "last", "link", "list", "made", "measure", "moment", "motion", "motions", "motors", "name", "names", "newest", "nextStep",
    "none", "note", "on", "opened", "outcome", "parent", "patient", "plane", "problem", "provider", "quantity", "reason", "recording",
    "recordings", "request", "requested", "shoulder", "shows", "side", "since", "software", "source", "stage", "station", "stations",
    "subject", "summary", "therapist", "time", "title", "tried", "typed", "unit", "until", "username", "what", "when", "where", "who",
    "why", "words", "written", "zone",
}  # fmt: skip
"""Parameters that are names, words, dates and times."""


def _texts(part: Any, place: str) -> Iterator[tuple[str, str]]:
    if isinstance(part, dict):
        for name, inner in part.items():
            yield from _texts(inner, f"{place}.{name}")
    elif isinstance(part, list):
        for inner in part:
            yield from _texts(inner, place)
    else:
        yield place, str(part)


NOT_NUMBERS: Final = {
    **dict.fromkeys(
        ("import-export.fhir.number", "patients.choice.nameAndNumber", "patients.patient.number", "station.identity.clinicNumber"), "a clinic number"
    ),
    "patients.stage.proposes": "formatted settings",
    **dict.fromkeys(
        ("commissioning.tuning.range", "commissioning.tuning.outside", "commissioning.ranges.span", "commissioning.settings.acceptedOf"),
        "in the unit that the row or field names",
    ),
}  # fmt: skip
"""Texts whose parameters are no numbers, or whose unit is elsewhere."""


@pytest.mark.parametrize("language", ["en", "ja"])
def test_numbers_in_texts_of_the_page_have_units(language: str) -> None:
    checked = 0
    for path in sorted((LOCALES / language).glob("*.json")):
        if path.stem in {"server", "plotly"}:
            continue
        for place, text in _texts(json.loads(path.read_text()), path.stem):
            for name in re.findall(r"\{\{(\w+)[^}]*\}\}", text):
                assert name in TEXT_NUMBERS.keys() | FORMATTED | WORDS, f"declare {name} of {place}: {text}"
                if name in TEXT_NUMBERS and place not in NOT_NUMBERS:
                    checked += 1
                    value = r"\{\{" + name + r"[^}]*\}\}"
                    assert re.search(TEXT_NUMBERS[name].replace("{}", value), text), (place, text)
    assert checked > 150


UNITLESS_TEXTS: Final = {"looks_like_radians"}
"""Messages about an unknown unit."""


def test_every_number_of_a_server_text_has_a_unit() -> None:
    messages = json.loads((ROOT / "frontend/server-messages.json").read_text())
    japanese = json.loads((LOCALES / "ja/server.json").read_text())
    checked = 0
    for code, english in messages.items():
        for name in re.findall(r"(?<!%)\{(\w+)(?!:text|:name)[^}]*\}", english):
            ending = max((suffix for suffix in SUFFIXES if name.endswith(suffix)), key=len, default=None)
            if ending is None or code in UNITLESS_TEXTS:
                continue
            checked += 1
            for text in (english, japanese[code]):
                after = text.partition("{" + name)[2]
                words = "|".join(re.escape(word) for word in SUFFIXES[ending])
                assert re.search(rf"\}}[^.。]*?(?:{words})", after), (code, text)
    assert checked > 50
