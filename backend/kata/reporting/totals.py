"""Words about the total of a questionnaire: its scale, and which change of it matters."""

from kata.reporting.content import QuestionnaireSeries
from kata.reporting.phrases import Phrases


def scale_of(scored: QuestionnaireSeries, phrases: Phrases) -> str:
    """Return the name of a questionnaire with the ends of its scale, and which end is better."""
    key = "scale.lower" if scored.better == "lower" else "scale.higher"
    return phrases.text(key, title=scored.title, lowest=scored.lowest, highest=scored.highest)


def limits_of(scored: QuestionnaireSeries, phrases: Phrases) -> str:
    """Return the sentences about which change of the total matters, with their sources."""
    important, detectable = scored.important, scored.detectable
    matters = phrases.text(
        "important_note" if important.up_to is None else "important_range_note",
        title=scored.title,
        least=important.points,
        most=important.up_to,
        source=important.source,
    )
    chance = phrases.text("detectable_note", detectable=detectable.points, source=detectable.source)
    scale = [phrases.text("t_score_note", title=scored.title)] if scored.is_t_score else []
    return " ".join([*scale, matters, chance])
