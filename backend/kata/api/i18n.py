"""What is wrong with a field, in the user's language: English, or Japanese where the browser prefers it."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal

Language = Literal["en", "ja"]

SENTENCES: Final[dict[str, tuple[str, str]]] = {
    "missing": ("is needed", "入力してください"),
    "extra_forbidden": ("is not known here", "ここでは使えない項目です"),
    "string_type": ("must be text", "文字で入力してください"),
    "string_empty": ("must not be empty", "入力してください"),
    "string_too_short": ("must have {min_length} characters or more", "{min_length}文字以上で入力してください"),
    "string_too_long": ("must have {max_length} characters or fewer", "{max_length}文字以内で入力してください"),
    "string_pattern_mismatch": ("holds characters that are not allowed here", "使えない文字が含まれています"),
    "string_unicode": ("holds characters that cannot be read", "読み取れない文字が含まれています"),
    "int_type": ("must be a whole number", "整数で入力してください"),
    "int_parsing": ("must be a whole number", "整数で入力してください"),
    "int_parsing_size": ("is too large a number", "数が大きすぎます"),
    "int_from_float": ("must be a whole number", "整数で入力してください"),
    "float_type": ("must be a number", "数で入力してください"),
    "float_parsing": ("must be a number", "数で入力してください"),
    "finite_number": ("must be a finite number", "有限の数で入力してください"),
    "greater_than": ("must be more than {gt:g}", "{gt:g}より大きくしてください"),
    "greater_than_equal": ("must be {ge:g} or more", "{ge:g}以上にしてください"),
    "less_than": ("must be less than {lt:g}", "{lt:g}より小さくしてください"),
    "less_than_equal": ("must be {le:g} or less", "{le:g}以下にしてください"),
    "angle_implausible": (
        "must be between {lowest:g} and {highest:g} degrees for this motion",
        "この運動では{lowest:g}度から{highest:g}度までにしてください",
    ),
    "position_of_another_motion": ("must be {allowed} for this motion", "この運動の肢位は {allowed} にしてください"),
    "measured_twice": ("must hold each side, motion, kind and position once", "同じ測定が二度あります"),
    "nothing_found": ("must hold something that was found", "所見を一つ以上入力してください"),
    "moment_out_of_range": ("must be between {year} and now", "{year}年から現在までにしてください"),
    "bool_type": ("must be true or false", "true か false で指定してください"),
    "bool_parsing": ("must be true or false", "true か false で指定してください"),
    "uuid_type": ("is no identifier", "識別子が正しくありません"),
    "uuid_parsing": ("is no identifier", "識別子が正しくありません"),
    "date_type": ("must be a day, such as 1968-04-12", "日付で入力してください(例: 1968-04-12)"),
    "date_parsing": ("must be a day, such as 1968-04-12", "日付で入力してください(例: 1968-04-12)"),
    "date_from_datetime_parsing": ("must be a day, such as 1968-04-12", "日付で入力してください(例: 1968-04-12)"),
    "date_from_datetime_inexact": ("must be a day without a time", "時刻のない日付で入力してください"),
    "datetime_type": (
        "must be a time, such as 2026-11-21T09:30:00Z",
        "日時で入力してください(例: 2026-11-21T09:30:00Z)",
    ),
    "datetime_parsing": (
        "must be a time, such as 2026-11-21T09:30:00Z",
        "日時で入力してください(例: 2026-11-21T09:30:00Z)",
    ),
    "datetime_from_date_parsing": (
        "must be a time, such as 2026-11-21T09:30:00Z",
        "日時で入力してください(例: 2026-11-21T09:30:00Z)",
    ),
    "datetime_object_invalid": ("is no time that there is", "存在しない日時です"),
    "timezone_aware": ("must say its time zone", "時間帯(タイムゾーン)を付けてください"),
    "literal_error": ("must be {expected}", "次のいずれかにしてください: {expected}"),
    "enum": ("must be {expected}", "次のいずれかにしてください: {expected}"),
    "list_type": ("must be a list", "一覧(リスト)で指定してください"),
    "set_type": ("must be a list", "一覧(リスト)で指定してください"),
    "dict_type": ("must be an object", "オブジェクトで指定してください"),
    "too_short": ("must have {min_length} entries or more", "{min_length}件以上にしてください"),
    "too_long": ("must have {max_length} entries or fewer", "{max_length}件以内にしてください"),
    "model_type": ("must be an object", "オブジェクトで指定してください"),
    "model_attributes_type": ("must be an object", "オブジェクトで指定してください"),
    "union_tag_not_found": ("must say in {discriminator} which kind it is", "{discriminator} で種類を指定してください"),
    "union_tag_invalid": ("must be one of {expected_tags}", "次のいずれかにしてください: {expected_tags}"),
    "json_invalid": ("is no JSON", "JSONとして読み取れません"),
    "json_type": ("is no JSON", "JSONとして読み取れません"),
    "bytes_type": ("must be a file", "ファイルで指定してください"),
    "bytes_too_long": ("must have {max_length} bytes or fewer", "{max_length}バイト以内にしてください"),
    "value_error": ("{error}", "値が正しくありません({error})"),
    # Our own.
    "day_out_of_range": ("must be between 1900 and today", "1900年から今日までの日付にしてください"),
    "limit_without_angle": ("must have a lowest or a highest angle", "下限か上限の角度を入力してください"),
    "limits_crossed": ("must have a lowest angle below the highest one", "下限は上限より小さくしてください"),
    "motion_twice": ("must name each motion once", "同じ運動を二度指定することはできません"),
}
"""By pydantic's type of error, or our own; bounds are filled in."""

NAMES: Final[dict[str, str]] = {
    "account_id": "アカウントの識別子",
    "account_ids": "担当者",
    "action": "操作",
    "affected_side": "治療する側",
    "after": "一覧の続き",
    "angle": "角度",
    "archived": "アーカイブ済み",
    "assessed_at": "評価日時",
    "assessed_by": "評価者",
    "assessment_id": "評価の識別子",
    "at": "位置",
    "back": "戻る角度",
    "based_on": "元の版",
    "birth_date": "生年月日",
    "chart": "グラフ",
    "check": "確認項目",
    "checked_by": "確認者",
    "clinic_number": "患者番号",
    "closing_note": "終了時の記録",
    "code": "符号",
    "contraindications": "禁忌",
    "decided_by": "決定者",
    "diagnosis": "診断名",
    "disabled": "無効",
    "do": "編集の種類",
    "dominant_side": "利き手",
    "down": "ペダル",
    "end": "終わり",
    "episode_id": "治療エピソードの識別子",
    "erasure_id": "消去依頼の識別子",
    "explanation": "説明",
    "fixtures": "固定具",
    "further": "終端を越える角度",
    "glass_id": "緊急閲覧の識別子",
    "highest": "上限",
    "hold": "静止時間",
    "iss": "発行者",
    "items": "項目",
    "kana": "フリガナ",
    "kind": "種類",
    "language": "言語",
    "less": "減らす角度",
    "limit": "件数",
    "limits": "医師による制限",
    "limits_by": "制限を決めた医師",
    "load_level": "抵抗許容レベル",
    "stops": "停止の回数",
    "seen_at": "表示された時刻",
    "looked_at": "目視で確認した項目",
    "lowest": "下限",
    "made_by": "処方者",
    "max_load_level": "最大抵抗許容レベル",
    "max_speed_deg_s": "最高速度",
    "method": "再生方法",
    "motion": "運動",
    "motion_id": "動作の識別子",
    "motors": "モータ",
    "name": "名前",
    "note": "記録",
    "noted_by": "記入者",
    "notes": "備考",
    "offset": "飛ばす件数",
    "old_password": "現在のパスワード",
    "onset_on": "発症日",
    "openid": "OpenID の識別子",
    "outcome": "結果",
    "pain_active": "自動運動時の痛み",
    "pain_after": "終了後の痛み",
    "pain_average": "平均疼痛",
    "pain_before": "開始前の痛み",
    "pain_during": "実施中の痛み",
    "pain_passive": "他動運動時の痛み",
    "pain_rest": "安静時の痛み",
    "password": "パスワード",
    "patient_id": "患者の識別子",
    "pause": "休止時間",
    "percent": "割合",
    "position": "肢位",
    "pressed": "非常停止",
    "programme_id": "プログラムの識別子",
    "programme_position": "プログラムの項目番号",
    "programme_version_id": "プログラムの版の識別子",
    "range": "可動域",
    "reason": "理由",
    "recording_id": "記録動作の識別子",
    "repetitions": "反復回数",
    "restricted": "閲覧制限",
    "role": "権限",
    "rom": "可動域の測定",
    "run_id": "再生の識別子",
    "search": "検索",
    "second_factor": "二要素認証",
    "secret": "リンクの符号",
    "session_id": "セッションの識別子",
    "sessions_per_week": "週の回数",
    "sex": "性別",
    "side": "側",
    "sign_in_id": "サインインの識別子",
    "signed_by": "署名者",
    "since": "開始日",
    "spadi": "SPADI(肩の質問票)",
    "speed": "速度",
    "stage": "病期",
    "stage_id": "病期の識別子",
    "start": "始まり",
    "state": "状態の符号",
    "station": "ステーション",
    "stations": "ステーション",
    "step": "増加幅",
    "stop": "停止の原因",
    "take_over": "引き継ぎ",
    "taught_by": "教示者",
    "text": "本文",
    "therapist": "療法士",
    "timer": "時間の上限",
    "to": "行き先",
    "until": "終了日",
    "updated_at": "更新日時",
    "username": "ユーザー名",
    "version": "版",
    "written_by": "追記者",
}
"""A field's name in Japanese, without its unit. In English a field is called what it is called."""

_UNITS: Final = {
    "_deg_s": ("degrees a second", "度/秒"),
    "_deg": ("degrees", "度"),
    "_percent": ("percent", "%"),
    "_minutes": ("minutes", "分"),
    "_ms": ("milliseconds", "ミリ秒"),
    "_s": ("seconds", "秒"),
    "_hz": ("Hz", "Hz"),
    "_nm": ("newton metres", "Nm"),
}


def preferred(accept_language: str) -> Language:
    """Of the languages that a browser asks for, the one that it likes best of ours; English where it likes none."""
    liked: dict[str, float] = {}
    for entry in accept_language.split(","):
        tag, _, weight = entry.strip().partition(";")
        primary = tag.strip().lower().partition("-")[0]
        try:
            quality = float(weight.strip().removeprefix("q=")) if weight else 1.0
        except ValueError:
            continue
        liked[primary] = max(quality, liked.get(primary, 0.0))
    return "ja" if liked.get("ja", 0.0) > liked.get("en", 0.0) else "en"


def sentence(kind: str, message: str, bounds: Mapping[str, Any], language: Language) -> str:
    """What is wrong with a field.

    :param kind: the type of error.
    :param message: what pydantic says, where a kind has no sentence of ours.
    :param bounds: what an error of this kind knows: bounds, and what was expected.
    """
    if kind == "string_too_short" and bounds.get("min_length") == 1:
        kind = "string_empty"
    if kind not in SENTENCES:
        kind, bounds = "value_error", {"error": message}
    told = {name: _lower(str(value)) if name == "error" else value for name, value in bounds.items()}
    if language == "ja" and "expected" in told:
        told["expected"] = str(told["expected"]).replace(" or ", ", ")
    return SENTENCES[kind][language == "ja"].format_map(told)


def name(path: Sequence[str | int], language: Language) -> str:
    """Of the field at a place in what was sent: ``limits 1, highest (degrees)``."""
    if not path:
        return "全体" if language == "ja" else "the request"
    told = ""
    for part in path:
        if isinstance(part, int):
            told += f" {part + 1}"
        else:
            told += (", " if told else "") + _one(part, language)
    return told.strip()


def _one(field: str, language: Language) -> str:
    for ending, unit in _UNITS.items():
        if field.endswith(ending):
            return f"{_called(field.removesuffix(ending), language)} ({unit[language == 'ja']})"
    return _called(field, language)


def _called(field: str, language: Language) -> str:
    return NAMES[field] if language == "ja" and field in NAMES else field.replace("_", " ")


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]
