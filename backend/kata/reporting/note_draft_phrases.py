"""Phrases of a drafted note in English and Japanese. They are whole sentences with parameters."""

from typing import Final

from kata.reporting.phrases import LANGUAGES, Language, Phrases

PHRASES: Final[dict[str, tuple[str, str]]] = {
    "between": (" ", ""),
    "and": (", ", "、"),
    "motions_between": ("; ", "、"),
    "shoulder.left": ("Left shoulder", "左肩"),
    "shoulder.right": ("Right shoulder", "右肩"),
    "shoulder.": ("Shoulder", "肩"),
    "without_programme": ("{shoulder}, without a programme.", "{shoulder}、プログラムなし。"),
    "with_programme": (
        "{shoulder}, programme {name} (version {number}).",
        "{shoulder}、プログラム「{name}」(第{number}版)。",
    ),
    "simulated": (
        "Simulated apparatus: the measured values are not those of a patient.",
        "模擬装置：測定値は患者のものではない。",
    ),
    "other_shoulder.left": ("{name}, left shoulder", "{name}・左肩"),
    "other_shoulder.right": ("{name}, right shoulder", "{name}・右肩"),
    "nothing_played": ("Nothing was played.", "再生は行わなかった。"),
    "played_once": ("{what}: {done} of {planned} repetition.", "{what}：{planned}回中{done}回実施。"),
    "played": ("{what}: {done} of {planned} repetitions.", "{what}：{planned}回中{done}回実施。"),
    "with_settings": ("{name} ({settings})", "{name}({settings})"),
    "settings.range": ("{percent:g} % of the range", "範囲{percent:g}%"),
    "settings.speed": ("{percent:g} % speed", "速度{percent:g}%"),
    "settings.pause": ("pause {seconds:g} s", "休止{seconds:g}秒"),
    "settings.learned": ("learned", "学習"),
    "settings.paper": ("as in the paper", "論文方式"),
    "settings.self_paced": ("pace set by the patient", "患者のペース"),
    "not_played": ("Not played: {names}.", "実施せず：{names}。"),
    "reached": (
        "Apparatus angle reached (not the patient's angle: the arm can slip in its cuff): {motions}.",
        "到達した装置角度(患者の角度ではない。腕は固定具の中で滑ることがある)：{motions}。",
    ),
    "reached_motion": ("{name} {low} to {high}°", "{name} {low}〜{high}°"),
    "patient_reached": (
        "Patient's angle, estimated from goniometer readings: {motions}.",
        "角度計の測定値から推定した患者の角度：{motions}。",
    ),
    "patient_reached_motion": (
        "{name} {low}° ± {low_u}° to {high}° ± {high_u}°",
        "{name} {low}° ± {low_u}° 〜 {high}° ± {high_u}°",
    ),
    "tracking": (
        "Tracking error at most {peak:.1f}° (motor {motor}, RMSE {rmse:.1f}°).",
        "追従誤差は最大{peak:.1f}°(モータ{motor}、RMSE {rmse:.1f}°)。",
    ),
    "less": (
        "The range was reduced in {name}: part of it was played with {percent:.0f} % of the range.",
        "「{name}」では可動範囲を狭める操作があり、一部を範囲{percent:.0f}%で実施。",
    ),
    "reversed_once": (
        "In {name} the arm met resistance and was moved back once (level {level}).",
        "「{name}」で腕が抵抗を受け、1回引き戻された(抵抗許容レベル{level})。",
    ),
    "reversed_twice": (
        "In {name} the arm met resistance and was moved back twice (level {level}).",
        "「{name}」で腕が抵抗を受け、2回引き戻された(抵抗許容レベル{level})。",
    ),
    "reversed": (
        "In {name} the arm met resistance and was moved back {count} times (level {level}).",
        "「{name}」で腕が抵抗を受け、{count}回引き戻された(抵抗許容レベル{level})。",
    ),
    "stopped": ("{name} was stopped: {cause}", "「{name}」は停止した。原因：{cause}"),
    "returned": ("{name} was ended early.", "「{name}」は途中で終了した。"),
    "interrupted": (
        "{name} was interrupted: the control program ended.",
        "「{name}」は制御プログラムの終了により中断した。",
    ),
    "pain": ("Pain (0 to 10): {given}.", "痛み(0〜10)：{given}。"),
    "pain.before": ("{pain} before", "前{pain}"),
    "pain.during": ("{pain} during", "中{pain}"),
    "pain.after": ("{pain} after", "後{pain}"),
}
"""English and Japanese text by key. The part of a key after the dot is a value of the record."""


class NotePhrases:
    """The phrases of a note in one language."""

    def __init__(self, language: Language) -> None:
        self._column = LANGUAGES.index(language)
        self._report_phrases = Phrases(language, "")

    def text(self, key: str, /, **values: object) -> str:
        """Return the phrase of a key, filled with its parameters."""
        return PHRASES[key][self._column].format(**values)

    def join(self, key: str, words: list[str]) -> str:
        """Join texts with the separator of a key."""
        return self.text(key).join(words)

    def motion(self, number: int, english: str) -> str:
        """Return the name of a basic motion within a sentence, without its number."""
        if self._report_phrases.language == "en":
            return f"{english[0].lower()}{english[1:]}"
        return self._report_phrases.named("motion", number)

    def stop(self, code: str, message: str, motor: int | None) -> str:
        """Return the cause of a stop as :meth:`kata.reporting.phrases.Phrases.stop` does."""
        return self._report_phrases.stop(code, message, motor)
