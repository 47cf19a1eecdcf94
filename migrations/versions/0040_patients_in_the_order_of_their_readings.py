"""Patients in the order of their readings

Revision ID: 0040
Revises: 0039
"""

import unicodedata

import sqlalchemy as sa
from alembic import op

revision = "0040"
down_revision = "0039"
branch_labels = None
depends_on = None

_PLAIN = str.maketrans("ぁぃぅぇぉっゃゅょゎゕゖ", "あいうえおつやゆよわかけ") | {0x3099: None, 0x309A: None}
_KANA_BY_VOWEL = {
    "あ": "あかさたなはまやらわ",
    "い": "いきしちにひみりゐ",
    "う": "うくすつぬふむゆる",
    "え": "えけせてねへめれゑ",
    "お": "おこそとのほもよろを",
}
_VOWEL = {kana: vowel for vowel, row in _KANA_BY_VOWEL.items() for kana in row}
_HIRAGANA = {katakana: katakana - 0x60 for katakana in range(0x30A1, 0x30F7)}


def upgrade() -> None:
    kind = sa.String(200).with_variant(sa.String(200, collation="C"), "postgresql")
    op.add_column("patients", sa.Column("sort_key", kind, nullable=False, server_default=""))
    columns = (sa.column("id", sa.Uuid()), sa.column("name"), sa.column("kana"), sa.column("sort_key"))
    patients = sa.table("patients", *columns)
    connection = op.get_bind()
    rows = connection.execute(sa.select(patients.c.id, patients.c.name, patients.c.kana))
    keys = [{"key": row.id, "sorted_by": _sort_key(row.name, row.kana)} for row in rows]
    if keys:
        change = sa.update(patients).where(patients.c.id == sa.bindparam("key"))
        connection.execute(change.values(sort_key=sa.bindparam("sorted_by")), keys)
    op.drop_index("ix_patients_name_id", "patients")
    op.create_index("ix_patients_sort_key_id", "patients", ["sort_key", "id", "archived_at", "search_text"])
    # A program of 0010 to 0039 sorts by the name, without an index. A patient whom it registers comes first until the record is changed.
    schemas = sa.table("schemas", sa.column("revision", sa.String), sa.column("oldest", sa.String))
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0010"}])


def _sort_key(name, kana):
    """Return the text that orders a patient, as the program's first version with it formed it."""
    is_latin = "LATIN" in unicodedata.name(name[:1] or " ", "")
    words = [_folded(word) for word in (name if is_latin else kana or name).split()]
    return "\n".join((" ".join(_plain(word) for word in words), " ".join(words)))[:200]


def _folded(word):
    plain = "".join(one for one in unicodedata.normalize("NFKD", word) if not "\u0300" <= one <= "\u036f")
    return "".join(unicodedata.normalize("NFC", plain).casefold().translate(_HIRAGANA).split())


def _plain(word):
    letters = []
    for letter in unicodedata.normalize("NFD", word).translate(_PLAIN):
        letters.append(_VOWEL.get(letters[-1], letter) if letter == "ー" and letters else letter)
    return "".join(letters)


def downgrade() -> None:
    op.execute(sa.text("DELETE FROM schemas WHERE revision = :revision").bindparams(revision=revision))
    op.drop_index("ix_patients_sort_key_id", "patients")
    op.drop_column("patients", "sort_key")
    op.create_index("ix_patients_name_id", "patients", ["name", "id", "archived_at", "search_text"])
