"""Invented people and texts of the demonstration clinic, in English and in Japanese."""

from dataclasses import dataclass
from typing import Final, Literal

from kata.auth.demonstration import ACCOUNTS, JAPANESE_NAMES

Language = Literal["en", "ja"]
MOST: Final = 60
"""Maximum number of invented patients."""
DETAILED: Final = 12
"""Number of first patients who have samples of every playback."""


@dataclass(frozen=True)
class Person:
    """An invented patient."""

    name: str
    kana: str
    sex: Literal["female", "male"]


_FAMILIES: Final = (
    ("Yamada", "ヤマダ", "山田"), ("Tanaka", "タナカ", "田中"), ("Suzuki", "スズキ", "鈴木"), ("Kobayashi", "コバヤシ", "小林"),
    ("Mori", "モリ", "森"), ("Abe", "アベ", "阿部"), ("Ishii", "イシイ", "石井"), ("Kato", "カトウ", "加藤"), ("Ogawa", "オガワ", "小川"),
    ("Hayashi", "ハヤシ", "林"), ("Maeda", "マエダ", "前田"), ("Okada", "オカダ", "岡田"), ("Ueda", "ウエダ", "上田"),
    ("Endo", "エンドウ", "遠藤"), ("Sakai", "サカイ", "酒井"), ("Goto", "ゴトウ", "後藤"), ("Kondo", "コンドウ", "近藤"),
    ("Miura", "ミウラ", "三浦"), ("Harada", "ハラダ", "原田"), ("Nomura", "ノムラ", "野村"),
)  # fmt: skip
_WOMEN: Final = (
    ("Hanako", "ハナコ", "花子"), ("Aoi", "アオイ", "葵"), ("Yuki", "ユキ", "由紀"), ("Nao", "ナオ", "奈央"), ("Emi", "エミ", "恵美"),
    ("Rin", "リン", "凛"), ("Kaori", "カオリ", "香織"), ("Mika", "ミカ", "美香"), ("Chie", "チエ", "千恵"), ("Tomoko", "トモコ", "智子"),
)  # fmt: skip
_MEN: Final = (
    ("Ren", "レン", "蓮"), ("Ken", "ケン", "健"), ("Taro", "タロウ", "太郎"), ("Haru", "ハル", "晴"), ("Jun", "ジュン", "純"),
    ("Sho", "ショウ", "翔"), ("Makoto", "マコト", "誠"), ("Osamu", "オサム", "修"), ("Hiroshi", "ヒロシ", "浩"), ("Takashi", "タカシ", "隆"),
)  # fmt: skip


def person(place: int, language: Language) -> Person:
    """Return the patient with the index ``place``, 0 to 59. No two patients have the same name."""
    if not 0 <= place < MOST:
        raise ValueError(f"there is no invented patient {place}")
    family = _FAMILIES[place % len(_FAMILIES)]
    female = place % 2 == 0
    # The first twelve have given names in order. Later rounds shift the given names, so that each pair of names occurs once.
    given_name = (_WOMEN if female else _MEN)[(place // 2 + 3 * (place // len(_FAMILIES))) % len(_WOMEN)]
    latin, kanji = f"{family[0]} {given_name[0]}", f"{family[2]} {given_name[2]}"
    return Person(kanji if language == "ja" else latin, f"{family[1]} {given_name[1]}", "female" if female else "male")


@dataclass(frozen=True)
class Words:
    """The texts that the invented staff writes, in one language."""

    mark: str
    therapists: tuple[str, ...]
    """The last one is the demonstration's therapist, whose first page would otherwise be empty."""
    stations: tuple[str, ...]
    motions: dict[int, str]
    """Names of the taught motions, by the number of the built-in motion."""
    doctor: str
    diagnosis: str
    programmes: dict[str, str]
    """Name of the programme, by the stage at the beginning."""
    stiff: str
    freer: str
    stopped: str
    asked: str
    discharged: str
    left: str


INVENTED_TEXTS: Final[dict[Language, Words]] = {
    "en": Words(
        mark="Invented for the demonstration. Not the record of a real person.",
        therapists=("Sato Mai", "Ito Daiki", "Watanabe Yui", "Nakajima Sora", ACCOUNTS["therapist"][1]),
        stations=("Station 1", "Station 2", "Station 3"),
        motions={
            1: "Abduction / adduction of the scapula",
            4: "Abduction / adduction of the shoulder",
            5: "Flexion / extension of the shoulder",
        },
        doctor="Dr. Nakamura",
        diagnosis="Frozen shoulder",
        programmes={"freezing": "Gentle motion", "frozen": "Range of motion", "thawing": "Full range"},
        stiff="Still stiff; the shoulder blade helps early.",
        freer="Moves more freely than last week.",
        stopped="The last motion was stopped at the patient's wish.",
        asked="Asked by telephone: no pain since.",
        discharged="Goal reached.",
        left="The patient did not come any more.",
    ),
    "ja": Words(
        mark="デモ用の架空の記録です。実在の人物のものではありません。",
        therapists=("佐藤 真衣", "伊藤 大輝", "渡辺 結衣", "中島 空", JAPANESE_NAMES["therapist"]),
        stations=("ステーション1", "ステーション2", "ステーション3"),
        motions={1: "肩甲骨の外転・内転", 4: "肩関節の外転・内転", 5: "肩関節の屈曲・伸展"},
        doctor="中村 医師",
        diagnosis="凍結肩",
        programmes={"freezing": "愛護的運動", "frozen": "可動域訓練", "thawing": "全可動域訓練"},
        stiff="まだ硬い。肩甲骨の代償が早く出る。",
        freer="先週より動きが滑らか。",
        stopped="患者の希望で最後の運動を停止した。",
        asked="電話で確認：その後の痛みなし。",
        discharged="目標を達成した。",
        left="来院が途絶えた。",
    ),
}
