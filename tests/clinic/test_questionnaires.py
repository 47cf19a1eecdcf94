"""Questionnaires: definitions as files, their scores, licensed texts, and their export.

``CASES`` are the ends, the missing answers and the formulas of the sources that the definitions name. ``WORKED`` are worked examples that others
have published with their results: of the SPADI, of the QuickDASH, and of the Oxford Knee Score, which sums 12 answers of 0 to 4 like the Oxford Shoulder Score. We have found no examples of the Oxford Shoulder Score and the ASES.
"""

import json
import random
from pathlib import Path
from typing import Any
from uuid import UUID

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import select
from typer.testing import CliRunner

from kata.cli.main import app
from kata.clinic.assessments import service as assessments
from kata.clinic.assessments import spadi
from kata.clinic.assessments.schemas import AssessmentCreate
from kata.clinic.assessments.tables import AssessmentRow
from kata.clinic.episodes.tables import EpisodeRow
from kata.clinic.questionnaires import definitions, service
from kata.clinic.questionnaires.changes import certain_above, meaning_of
from kata.clinic.questionnaires.definitions import DEFINITIONS, SPADI, read_definition, use_folder
from kata.clinic.questionnaires.licensed_texts import read_texts
from kata.clinic.questionnaires.tables import QuestionnaireTextsRow
from kata.database.base import utc_now
from kata.database.engine import Database
from kata.interop import fhir_care
from tests.support.fhir_bundle import exported, judged, of_kind
from tests.support.fhir_patient import treated
from tests.support.questionnaires import PROMIS, T_SCORES, TEMPLATE, clinics_promis, promis_file, words_of
from tests.support.validators import calculate_scores

__all__ = ["clinics_promis"]

CASES: tuple[tuple[str, list[Any], float | None], ...] = (
    ("spadi", [0] * 13, 0.0),
    ("spadi", [10] * 13, 100.0),
    ("spadi", [6] * 5 + [3] * 8, 45.0),
    ("spadi", [0] * 5 + [10] * 8, 50.0),
    ("spadi", [None, 6, 6, 6, 2] + [3] * 8, 40.0),
    ("spadi", [None] + [6] * 4 + [None, 10] + [3] * 6, 50.0),
    ("spadi", [6] * 5 + [None, None] + [3] * 6, 45.0),
    ("spadi", [6] * 5 + [None] * 3 + [3] * 5, None),
    ("quickdash", [1] * 11, 0.0),
    ("quickdash", [5] * 11, 100.0),
    ("quickdash", [3] * 11, 50.0),
    ("quickdash", [5, *[1] * 10], 100 / 11),
    ("quickdash", [2] * 10 + [None], 25.0),
    ("quickdash", [None, 5, *[1] * 9], 10.0),
    ("quickdash", [2] * 9 + [None] * 2, None),
    ("oxford", [4] * 12, 48.0),
    ("oxford", [0] * 12, 0.0),
    ("oxford", [3] * 6 + [1] * 6, 24.0),
    ("oxford", [4, *[0] * 11], 4.0),
    ("oxford", [4] * 11 + [None], None),
    ("ases", [0] + [3] * 10, 100.0),
    ("ases", [10] + [0] * 10, 0.0),
    ("ases", [4] + [2] * 10, (10 - 4) * 5 + 5 / 3 * 20),
    ("ases", [0] + [0] * 10, 50.0),
    ("ases", [10] + [3] * 10, 50.0),
    ("ases", [10, 1, *[0] * 9], 5 / 3),
    ("ases", [None] + [2] * 10, None),
    ("ases", [4, None, *[2] * 9], None),
)

WORKED: tuple[tuple[str, list[Any], float], ...] = (
    ("spadi", [3, 2, 3, 2, 3, 5, 4, 3, 4, 4, 3, 5, 1], 31.125),
    ("quickdash", [1, 2, 3, 4, 1, 1, 2, 3, 5, 1, 1], 29.545),
    ("quickdash", [1] * 10 + [None], 0.0),
    ("oxford", [0, 4, 2, 2, 3, 4, 1, 0, 2, 1, 0, 3], 22.0),
)
"""From the tests of another implementation: Awell Health, awell-score, src/scores/{spadi,quickdash,oxford_knee_score}, commit c37843e5
(2026-08-13). It agrees on both scales of the SPADI, 26 and 36.25, and takes the mean of both as the total."""


@pytest.mark.parametrize(("code", "answers", "total"), WORKED)
def test_score_agrees_with_a_published_worked_example(code: str, answers: list[int | None], total: float) -> None:
    assert definitions.score(DEFINITIONS[code], answers).total == pytest.approx(total, abs=0.0005)


def test_scales_of_the_worked_spadi_agree() -> None:
    assert definitions.score(SPADI, WORKED[0][1]).scales == {
        "pain": pytest.approx(26),
        "disability": pytest.approx(36.25),
    }


def test_missing_answers_leave_sum_and_maximum_as_published() -> None:
    """From the same tests. Five of 13 are missing there: Kata gives such a questionnaire no score, but divides in the same way."""
    answers = [None, None, 4, 5, 2, 5, 4, None, None, 4, None, 5, 1]
    without_limit = definitions.score(msgspec.structs.replace(SPADI, most_unanswered=13), answers)
    assert without_limit.scales == {"pain": pytest.approx(36.67, abs=0.005), "disability": pytest.approx(38)}
    assert without_limit.total == pytest.approx(37.335, abs=0.005)
    assert definitions.score(SPADI, answers).total is None


@pytest.mark.parametrize(("code", "answers", "total"), CASES)
def test_score_follows_the_formula_of_its_source(code: str, answers: list[int | None], total: float | None) -> None:
    definition = DEFINITIONS[code]
    assert definition.fits(answers)
    found = definitions.score(definition, answers).total
    assert found == (None if total is None else pytest.approx(total))


def test_exported_expressions_calculate_the_same_scores() -> None:
    """Another project's FHIRPath evaluates them, for random answers of which some are missing."""
    chance = random.Random(0)
    cases = [
        (
            definition,
            [
                None if chance.random() < missing else chance.randint(s.lowest, s.highest)
                for s in definition.item_scales
            ],
        )
        for definition in (DEFINITIONS[code] for code in ("spadi", "quickdash", "oxford", "ases"))
        for missing in (0.0, 0.1, 0.2, 1.0)
        for _ in range(20)
    ]
    calculated = calculate_scores(
        [
            {
                "questionnaire": fhir_care.questionnaire(definition, None),
                "response": {
                    "resourceType": "QuestionnaireResponse",
                    "item": [
                        {"linkId": str(number), "answer": [] if answer is None else [{"valueInteger": answer}]}
                        for number, answer in enumerate(answers, start=1)
                    ],
                },
            }
            for definition, answers in cases
        ]
    )
    for (definition, answers), values in zip(cases, calculated, strict=True):
        own = definitions.score(definition, answers)
        expected = {f"score-{name}": value for name, value in {**own.scales, "total": own.total}.items()}
        assert values == {name: None if value is None else pytest.approx(value) for name, value in expected.items()}


def test_an_exported_t_score_has_no_table(clinics_promis: Path) -> None:
    exported_items = fhir_care.questionnaire(DEFINITIONS[PROMIS], None)["item"]
    assert [item["linkId"] for item in exported_items] == [str(number) for number in range(1, 8)]


def test_every_definition_is_complete_and_has_its_sources() -> None:
    assert {"spadi", "quickdash", "oxford", "ases"} <= set(DEFINITIONS)
    for definition in DEFINITIONS.values():
        scales = definition.item_scales
        totals = (
            definitions.score(definition, [getattr(scale, end) for scale in scales]).total
            for end in ("lowest", "highest")
        )
        ends = sorted(total or 0.0 for total in totals)
        # A higher pain is worse and a higher function is better in the ASES.
        if definition.code != "ases":
            assert ends == pytest.approx([0, definition.highest_total])
        assert definition.important.source
        assert definition.detectable.source
        assert definition.scoring_source
        assert definition.copyright


def test_spadi_of_the_form_is_scored_from_its_file() -> None:
    assert [item.subscale for item in spadi.ITEMS] == [scale.code for scale in DEFINITIONS["spadi"].item_scales]
    assert (spadi.IMPORTANT_CHANGE, spadi.DETECTABLE_CHANGE) == ((8, 13), 17)


@given(st.sampled_from(["spadi", "quickdash", "oxford", "ases"]), st.booleans(), st.floats(-0.2, 0.2))
def test_verdict_never_contradicts_the_change_as_shown(code: str, certain: bool, beyond: float) -> None:
    """Changes close to a limit occur, because answers may be missing and T-scores have decimals."""
    definition = DEFINITIONS[code]
    change = beyond + (certain_above(definition) if certain else definition.important.points)
    shown = float(f"{change:.1f}")
    meaning = meaning_of(definition, change)
    assert (meaning == "none") is (shown < definition.important.points)
    assert (meaning in ("better", "worse")) is (shown > certain_above(definition))


def test_change_of_a_t_score_is_judged_without_binary_fractions() -> None:
    definition = msgspec.structs.replace(SPADI, important=definitions.Threshold(3.0, "invented"))
    assert 32.3 - 29.3 < 3.0
    assert meaning_of(definition, 29.3 - 32.3) == "perhaps_better"


# -- a clinic's own definitions --------------------------------------------------------------------------------------


def test_definition_of_a_clinic_is_scored_by_its_table(clinics_promis: Path) -> None:
    definition = DEFINITIONS[PROMIS]
    cases: list[tuple[list[int | None], float | None]] = [
        ([1] * 7, T_SCORES[0]),
        ([5] * 7, T_SCORES[-1]),
        ([1, 2, 3, 4, 5, 1, 2], T_SCORES[18 - 7]),
        ([5] * 6 + [None], None),
    ]
    for answers, total in cases:
        assert definition.fits(answers)
        assert definitions.score(definition, answers).total == total
    use_folder(clinics_promis / "nothing")
    assert PROMIS not in DEFINITIONS


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (("conversion = [", "conversion = [1.0, "), "must have 29 T-scores, one for each sum, not 30"),
        (("31.0", "30.0"), "must rise from each sum to the next"),
        (("most_unanswered = 0", "most_unanswered = 1"), "a T-score needs every answer"),
        (("highest_total = 48.0", "highest_total = 80"), "must be the last T-score"),
        (('total = "t_score"', 'total = "sum"'), "belongs to the total t_score"),
        (("highest = 5", "highest = 1"), "a highest answer above the lowest"),
        (('code = "promis', 'code = "../promis'), "code"),
        (('code = "promis_upper_extremity_7a"', 'code = "spadi"'), "Kata has its own definition of spadi"),
        (("items = 7", "itemz = 7"), "itemz"),
    ],
)
def test_wrong_definition_is_refused_with_its_reason(tmp_path: Path, change: tuple[str, str], complaint: str) -> None:
    file = promis_file(tmp_path / "given.toml")
    text = file.read_text()
    assert change[0] in text
    file.write_text(text.replace(*change))
    data = tmp_path / "clinic"
    refused = CliRunner().invoke(app, ["questionnaires", "add", str(file), "--data", str(data)])
    assert refused.exit_code == 1
    assert complaint in " ".join(refused.output.split())
    assert not list(data.rglob("*.toml"))


def test_published_template_lacks_only_the_clinics_table(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="must have 29 T-scores, one for each sum, not 0"):
        read_definition(TEMPLATE)
    assert read_definition(promis_file(tmp_path / "whole.toml")).scales[0].items == 7


def test_added_definition_is_used_and_a_broken_file_left_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    data = ["--data", str(tmp_path)]
    added = CliRunner().invoke(app, ["questionnaires", "add", str(promis_file(tmp_path / "given.toml")), *data])
    assert (added.exit_code, "7 items" in added.output) == (0, True), added.output
    (tmp_path / "questionnaires/broken.toml").write_text("code = 1")
    try:
        use_folder(definitions.clinic_folder(tmp_path))
        assert PROMIS in DEFINITIONS
        assert "broken.toml is not used" in caplog.text
        words = tmp_path / "words.json"
        words.write_text(json.dumps(words_of(PROMIS, "ja")))
        imported = CliRunner().invoke(app, ["questionnaires", "import", PROMIS, str(words), *data])
        assert (imported.exit_code, "7 items" in imported.output) == (0, True), imported.output
    finally:
        use_folder(tmp_path / "nothing")


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_t_score_is_shown_and_exported_as_one(database: Database, clinics_promis: Path, tmp_path: Path) -> None:
    patient_id = treated(database, sessions=0)
    answered(database, patient_id, PROMIS, [4] * 7)
    with database.read() as session:
        (row,) = session.scalars(select(AssessmentRow))
        (shown,) = assessments.as_assessment(row).questionnaires
    assert (shown.title, shown.total_points, shown.is_t_score) == ("PROMIS Upper Extremity 7a", T_SCORES[28 - 7], True)
    bundle = exported(database, patient_id, tmp_path / "bundle.json")
    assert judged({"bundle": bundle}) == {"bundle": []}
    (total,) = [
        resource for resource in of_kind(bundle, "Observation") if f"{PROMIS}-total" in json.dumps(resource["code"])
    ]
    assert total["valueQuantity"]["value"] == T_SCORES[28 - 7]
    assert "T-score (50 is the mean" in total["code"]["coding"][0]["display"]


# -- licensed texts -------------------------------------------------------------------------------------------------


def test_texts_of_a_clinic_are_imported_and_replaced(database: Database) -> None:
    definition = DEFINITIONS["quickdash"]
    for title in ("First", "Second"):
        given = read_texts(json.dumps(words_of("quickdash", "ja") | {"title": title}).encode(), definition)
        with database.write() as session:
            service.store_texts(session, "quickdash", given, utc_now(), may_be_exported=False)
    with database.read() as session:
        (row,) = session.scalars(select(QuestionnaireTextsRow)).all()
        assert (row.title, len(row.items)) == ("Second", 11)
        languages = {questionnaire.code: questionnaire.languages for questionnaire in service.questionnaires(session)}
    assert languages == {key: [] for key in DEFINITIONS} | {"quickdash": ["ja"]}


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"resourceType": "Patient"}, "not a FHIR Questionnaire"),
        ({"language": "de"}, "language must be one of en, ja"),
        ({"copyright": " "}, "must have a copyright"),
        ({"item": [{"linkId": "1", "text": "A"}]}, "has the items 1 to 13; the file has 1"),
        ({"item": [{"linkId": "1", "text": "A"}, {"linkId": "1", "text": "B"}]}, "the item 1 occurs twice"),
        ({"item": [{"linkId": "1"}]}, "item 1 must have a text"),
        ({"item": []}, "the file has none"),
    ],
)
def test_wrong_file_of_texts_is_refused_with_its_reason(change: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        read_texts(json.dumps(words_of("spadi", "en") | change).encode(), DEFINITIONS["spadi"])


def test_answer_that_an_item_does_not_have_is_refused() -> None:
    words = words_of("spadi", "en")
    words["item"][2]["answerOption"] = [{"valueCoding": {"code": "11", "display": "More than the worst"}}]
    with pytest.raises(ValueError, match="item 3 is answered 0 to 10, not 11"):
        read_texts(json.dumps(words).encode(), DEFINITIONS["spadi"])
    with pytest.raises(ValueError, match="not JSON"):
        read_texts(b"\xff", DEFINITIONS["spadi"])


def test_command_imports_texts_or_says_what_is_wrong(tmp_path: Path) -> None:
    file = tmp_path / "words.json"
    file.write_text(json.dumps(words_of("spadi", "en")))
    data = ["--data", str(tmp_path / "clinic")]
    done = CliRunner().invoke(app, ["questionnaires", "import", "spadi", str(file), *data])
    assert (done.exit_code, "13 items" in done.output) == (0, True), done.output
    database = Database(f"sqlite:///{tmp_path / 'clinic/kata.db'}")
    with database.read() as session:
        assert session.scalars(select(QuestionnaireTextsRow.questionnaire)).all() == ["spadi"]
    database.close()
    file.write_text("{}")
    for code, complaint in (("spadi", "not a FHIR Questionnaire"), ("dash", "There is no questionnaire dash")):
        refused = CliRunner().invoke(app, ["questionnaires", "import", code, str(file), *data])
        assert refused.exit_code == 1
        assert complaint in " ".join(refused.output.split())


# -- export ---------------------------------------------------------------------------------------------------------


def answered(database: Database, patient_id: UUID, code: str, answers: list[int | None]) -> None:
    with database.write() as session:
        episode = session.scalars(select(EpisodeRow).filter_by(patient_id=patient_id)).one()
        found = AssessmentCreate.model_construct(
            assessed_at=utc_now(), assessed_by="Sato Mai", rom=[], spadi=None, note=""
        )
        assessments.create(session, episode.id, found, {code: answers})


@pytest.mark.parametrize("may_be_exported", [True, False])
@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_texts_are_exported_only_where_their_licence_allows(
    database: Database, tmp_path: Path, may_be_exported: bool
) -> None:
    patient_id = treated(database, sessions=1)
    answered(database, patient_id, "quickdash", [2] * 10 + [None])
    given = read_texts(json.dumps(words_of("quickdash", "en")).encode(), DEFINITIONS["quickdash"])
    with database.write() as session:
        service.store_texts(session, "quickdash", given, utc_now(), may_be_exported=may_be_exported)
    bundle = exported(database, patient_id, tmp_path / "bundle.json")
    assert judged({"bundle": bundle}) == {"bundle": []}
    assert (given.items[0].text in json.dumps(bundle)) is may_be_exported
    questionnaires = {resource["url"]: resource for resource in of_kind(bundle, "Questionnaire")}
    assert len(questionnaires) == 2
    (response,) = [resource for resource in of_kind(bundle, "QuestionnaireResponse") if len(resource["item"]) == 11]
    assert questionnaires[response["questionnaire"]]["copyright"] == given.copyright if may_be_exported else True
    totals = [
        resource
        for resource in of_kind(bundle, "Observation")
        if resource["code"].get("coding", [{}])[0]["code"] == "quickdash-total"
    ]
    assert [(total["valueQuantity"]["value"], total["bodySite"]["coding"][0]["code"]) for total in totals] == [
        (25, "91775009")
    ]


def test_assessment_of_a_questionnaire_shows_its_total(database: Database) -> None:
    patient_id = treated(database, sessions=0)
    answered(database, patient_id, "oxford", [3] * 12)
    answered(database, patient_id, "of_tomorrow", [1, 2])
    with database.read() as session:
        shown = [assessments.as_assessment(row) for row in session.scalars(select(AssessmentRow))]
    found = {
        questionnaire.code: (questionnaire.total_points, questionnaire.highest_points)
        for row in shown
        for questionnaire in row.questionnaires
    }
    assert found == {"oxford": (36.0, 48.0), "of_tomorrow": (None, None)}
