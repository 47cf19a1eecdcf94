"""What every number means: its unit, from its name or from a declaration here.

A number's name ends with its unit, or the name is declared. A new field with neither fails ``tests/clinic/test_units.py``.
"""

from dataclasses import asdict, dataclass
from typing import Any, Final

SUFFIXES: Final = {
    "_deg": ("deg", "°", "degrees", "度"),
    "_deg_s": ("deg/s", "°/s", "度/秒", "°"),
    "_nm": ("Nm",),
    "_nm_deg": ("Nm/deg", "Nm/°"),
    "_ms": ("ms", "ミリ秒"),
    "_s": ("s", "seconds", "秒"),
    "_hz": ("Hz",),
    "_v": ("V",),
    "_c": ("°C",),
    "_percent": ("%",),
    "_years": ("years", "歳"),
    "_points": ("points", "点"),
    "_minutes": ("min", "minutes", "分"),
    "_bytes": ("bytes", "kB", "MB", "GB"),
}
"""Ending of a name, and the words for its unit in English and Japanese texts."""

ORDINAL: Final = "a place in an order"
COUNT: Final = "a number of things"
SCORE_10: Final = "a score of 0 to 10"
SCORE_100: Final = "a score of 0 to 100"
LEVEL: Final = "a resistance level of 1 to 25"

DECLARED: Final[dict[str, str]] = {
    **dict.fromkeys(
        ("motor", "axis", "motion", "outward", "position", "programme_position", "number", "version", "take", "category", "status"), ORDINAL
    ),
    **dict.fromkeys(
        (
            "sessions", "sessions_wished", "sessions_per_week", "repetitions", "repetitions_planned", "repetitions_done", "runs", "stops",
            "run_count", "stop_count", "samples", "reversals", "takes", "cycles", "overruns", "bus_errors", "drive_errors",
            "telemetry_dropped", "waiting", "audit_rows", "digits", "programmes", "overdue", "prescribed", "held", "playbacks", "stopped",
            "alarms", "due_count", "patients", "shoulders", "least_patients", "presses", "passes",
        ),
        COUNT,
    ),
    **dict.fromkeys(("pain_before", "pain_during", "pain_after", "pain_rest", "pain_active", "pain_passive", "pain_average", "spadi"), SCORE_10),
    **dict.fromkeys(
        ("pain", "disability", "total", "spadi_score", "spadi_perhaps_important", "spadi_important", "spadi_detectable"), SCORE_100
    ),
    **dict.fromkeys(("load_level", "max_load_level"), LEVEL),
    **dict.fromkeys(("taught_smoothness", "played_smoothness"), "spectral arc length, which has no unit"),
    **dict.fromkeys(("ratio", "ratio_deviation"), "degrees for each degree, which has no unit"),
    **dict.fromkeys(("p_gain", "i_gain", "d_gain", "p", "i", "d"), "in the drive's own units"),
    "overshoot": "a share of the step",
    "minutes": "minutes",
    "valid_days": "days",
    "hours": "hours",
    "weeks_to_important": "weeks",
    "points": "points",
    "items": COUNT,
    "most_unanswered": COUNT,
    "answers": "answers on the scale of each item",
    "answer": "an answer on the scale of its item",
    "bytes": "bytes",
    **dict.fromkeys(("before", "after"), "a value of a commissioning record; its name contains the unit"),
}  # fmt: skip
"""Names of numbers without a unit in their name."""


def unit_of(name: str) -> str | None:
    """Return the unit or meaning of a number, None if it is not declared."""
    endings = [ending for ending in SUFFIXES if name.endswith(ending)]
    return DECLARED.get(name) or (max(endings, key=len) if endings else None)


def is_of_a_body(name: str) -> bool:
    """True if the number is an angle, a torque or a score of a person, which needs a side and a time."""
    return unit_of(name) in {"_deg", "_nm", "_points", SCORE_10, SCORE_100}


@dataclass(frozen=True)
class UnitWords:
    """What may stand beside a number on a page of one language. All are regular expressions."""

    units_after: str
    """Units and other words that follow a number."""
    counted: tuple[str, ...]
    """Words of counted things, which follow their number."""
    placed: tuple[str, ...]
    """Words before the number of a place, of a level or of a thing that is called by a number."""
    count_heads: tuple[str, ...]
    """Heads of table columns with counts and places."""
    scales: str
    unit_head: str
    """Head of the column that has the units of a table's rows."""
    axes: str
    """Titles of axes and panels that have another word than a unit."""


_UNITS: Final = r"°|[Dd]eg(?:rees)?\b|ms\b|s\b|%|Hz\b|Nm\b|min\b|kB\b|MB\b|GB\b|V\b|/s\b"
UNIT_WORDS: Final = {
    "en": UnitWords(
        units_after=_UNITS + r"|years?\b|bytes\b|points?\b|minutes?\b|seconds?\b|cycles?\b|h\b|\(no unit\)",
        counted=(
            "repetitions?", "samples?", "sessions?", "recordings?", "rows?", "times", "items?", "checks?", "playbacks?", "weeks?", "motors?",
            "characters?", "errors?", "patients?", "programmes?", "entries", "access(?:es)?", "codes?", "days?", "hours?", "months?", "cycles?",
            "of the five motors", "shoulders?",
        ),
        placed=("category",
            "Motor", "motor", r"Motors(?: \d and)?", "Version", "version", "Playback", "Station", "Take", "take", "Step", "step", "level", "Level", "number", "item", "M",
            "Kata", r"No\.", "fixer", "SPADI", "Table", "WCAG", "playback", "run",
        ),
        count_heads=(
            "Playbacks", "Stopped", "Measurements", "Sessions", "Alarms", "As prescribed", "Motor", "Motion", "Version", "Repetitions", "Samples", "Number", r"No\.", "Patients", "Shoulders", "Audit",
            "Subject",
        ),
        scales=r"T-score|0 to 10|0 \(none\) to 10|0 \(best\) to 100|of 10\b|of 100|of 25|level|0: no pain|0 is no pain",
        unit_head="Unit",
        axes=", deg|Week|Number|^Sessions$",
    ),
    "ja": UnitWords(
        units_after=_UNITS + r"|周期|[歳度点秒分回件個名人日週月年時行版段番問例台本組種通つ肢軸]|ミリ秒|か月|時間|文字|バイト|サイクル|（単位なし）",
        counted=("時間", "反復", "項目", "動作", "セッション", "エピソード", "モータ", "患者", "肩", "種類", "か所", "ビット", "桁"),
        placed=("カテゴリ", "モータ", r"手順\d+[／/]", "版", "第", "ステーション", "Station", "収録", "手順", "レベル", "番号", "項目", "M", "Kata", r"No\.", "固定具", "表", "再生", "記録", "Table", "WCAG"),
        count_heads=("バージョン", "セッション", "アラーム", "再生", "回数", "停止", "測定数", "モータ", "動作", "版", "反復", "測定点", "番号", "患者", "監査", "対象", "数"),
        scales=r"Tスコア|点満点|0[〜～]10|0：なし|0：最良|0（なし）|0は|/ ?10\b|10段階|／100|25段階|レベル",
        unit_head="単位",
        axes="°|週|回数|数|^セッション$",
    ),
}  # fmt: skip

_BARE_NUMBERS: Final = r"""(words) => {
    const number = /(?<![\w.\-/−+])[+\-−]?\d+(?:[.,]\d+)?(?![\w\-]|\.\d)/g;
    // Dates, times, and year, volume, issue and pages of a cited article.
    const moment = new RegExp([
        '[A-Z][a-z]+ (?:19|20)\\d{2}(?:, \\d+)+', '(?:19|20)\\d{2}; \\d+: \\d+',
        '(?:[A-Z][a-z]+|et al\\.|他) ?(?:19|20)\\d{2}, [A-Z][A-Za-z ]+ \\d+(?:\\(\\d+\\))?, \\d+(?:-\\d+)?',
        '\\d{1,2}:\\d{2}(?::\\d{2})?(?:\\s?[AP]M)?', '\\d{4}-\\d{2}-\\d{2}', '[A-Z][a-z]{2} \\d{1,2}, \\d{4}',
        '\\d{1,2} [A-Z][a-z]{2,} \\d{4}', '\\d{4}年(?:\\d{1,2}月(?:\\d{1,2}日)?)?', '\\d{1,2}/\\d{1,2}',
        '(?:[a-z], |revised |et al\\. )(?:19|20)\\d{2}(?=[.,;)])',
    ].join('|'), 'g');
    const any = (list) => '(?:' + list.join('|') + ')';
    const range = '(?:(?:to|of|and|or|–|/|〜|～|／|±|から|→)\\s?[+\\-−]?[\\d.]+\\s?)*';
    const after = new RegExp('^\\s?' + range + '(?:' + words.units_after + ')');
    const thing = new RegExp('^\\s?(?:(?:of|to) [\\d.]+ )?(?:[a-z]+ )?' + any(words.counted) + '(?![a-z])');
    const place = new RegExp(any(words.placed) + '\\s?$|\\bof\\s?$|^$');
    // "Sessions that were stopped: 0"
    const countedBefore = new RegExp(any([...words.counted, 'runs']) + '(?![a-z])[^.:：]*[:：] ?(?:\\d+ of )?$', 'i');
    // The letters of a unit are not the end of another word.
    const inContext = new RegExp('(?<![A-Za-z])(?:' + words.units_after + ')|' + words.scales);
    const countedHead = new RegExp(any(words.count_heads));
    const found = [];
    const headingBefore = (one) => document.evaluate(
        'preceding::*[self::h2 or self::h3][1]', one, null, XPathResult.FIRST_ORDERED_NODE_TYPE).singleNodeValue;

    // Each tick of a figure has its unit in the title of its axis or panel.
    const axisWords = new RegExp('(?<![A-Za-z])(?:' + words.units_after + ')|' + words.scales + '|' + words.axes);
    for (const figure of document.querySelectorAll('.js-plotly-plot')) {
        const layout = figure._fullLayout;
        if (!layout) {
            // Not drawn by Plotly.
            const titles = [...figure.querySelectorAll('.xtitle, .ytitle')].map((one) => one.textContent).join(' | ');
            if (!axisWords.test(titles)) found.push('a figure with the titles "' + titles.slice(0, 150) + '"');
            continue;
        }
        const axes = Object.entries(layout).filter(([name, axis]) => /^[xy]axis\d*$/.test(name) && axis.visible !== false);
        const titleOf = (axis) => axis.title?.text ?? '';
        for (const [name, axis] of axes) {
            if (axis.type === 'date' || axis.type === 'category') continue;
            const panels = (layout.annotations ?? []).filter((one) => name[0] === 'y' && Math.abs(one.y - axis.domain[1]) < 0.02);
            // Panels above each other share the title of the lowest one's x axis.
            const shared = axes.filter(([other, one]) => name[0] === 'x' && other[0] === 'x' && one.domain[0] === axis.domain[0]);
            const texts = [titleOf(axis), axis.ticksuffix ?? '', ...panels.map((one) => one.text), ...shared.map(([, one]) => titleOf(one))];
            if (!texts.some((one) => axisWords.test(one))) found.push(`an axis ${name} with the titles "${texts.join(' | ').slice(0, 150)}"`);
        }
    }

    const look = (root) => {
        const walker = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
        for (let node = walker.nextNode(); node; node = walker.nextNode()) {
            const element = node.parentElement;
            if (!/\d/.test(node.data) || !element.checkVisibility() || element.closest('.js-plotly-plot, script, style')) continue;
            // The number of a step in a list of steps.
            if (/^\d+$/.test(node.data.trim()) && element.closest('ol > li, nav button')) continue;
            const cell = element.closest('td, th');
            const block = cell ?? element.closest('p, li, button, label, h1, h2, h3, h4, caption, legend, [role=status], a, text:not(a text), div') ?? element;
            const text = (block.innerText ?? block.textContent).replace(moment, ' ');
            let context = (block.getAttribute('aria-label') ?? '') + ' ' + (element.closest('figure')?.querySelector('figcaption')?.textContent ?? '');
            const group = element.closest('[role=radiogroup], fieldset, [role=group], section');
            context += ' ' + (group?.getAttribute('aria-label') ?? '') + ' ' + (group?.querySelector('legend, label')?.textContent ?? '');
            let head = '';
            if (cell) {
                const table = cell.closest('table');
                const column = [...cell.parentElement.children].indexOf(cell);
                const rows = [...table.querySelectorAll('thead tr')];
                head = rows.map((row) => row.children[Math.min(column, row.children.length - 1)]?.textContent ?? '').join(' ');
                context += ' ' + head;
                // The unit of a row, in a column of its own. A row of texts has none.
                const units = [...(rows[0]?.children ?? [])].findIndex((one) => one.textContent.trim() === words.unit_head);
                const unit = units < 0 ? null : cell.parentElement.children[units].textContent.trim();
                if (unit || (unit === '' && /[^\d.,\s−-]/.test(cell.textContent))) continue;
                context += ' ' + (rows[0]?.children[0]?.textContent ?? '');
                context += ' ' + (headingBefore(table)?.textContent ?? '');
                context += ' ' + (table.querySelector('caption')?.textContent ?? '') + ' ' + (table.getAttribute('aria-label') ?? '');
            }
            for (const match of text.matchAll(number)) {
                if (!node.data.includes(match[0])) continue;
                const rest = text.slice(match.index + match[0].length);
                const before = text.slice(0, match.index);
                if (after.test(rest) || thing.test(rest) || (!before.trim() && /^(?:\. |\n)/.test(rest))) continue;
                if ((before.trim() && place.test(before)) || countedBefore.test(before)) continue;
                if (inContext.test(context) || countedHead.test(head) || new RegExp(words.scales).test(text)) continue;
                found.push(match[0] + ' in "' + text.trim().slice(0, 120) + '"' + (cell ? ' under "' + context.trim().slice(0, 80) + '"' : ''));
            }
        }
    };
    look(document.querySelector('main') ?? document.body);
    for (const dialog of document.querySelectorAll('[role=dialog]')) look(dialog);
    return [...new Set(found)];
}"""


def bare_numbers(page: Any, language: str = "en") -> list[str]:
    """Return the numbers that page, figures and dialogs show without a unit, a scale or a word for what is counted."""
    found = page.evaluate(_BARE_NUMBERS, asdict(UNIT_WORDS[language]))
    return [str(text) for text in found]
