// Returns the numbers that a page shows without a unit. tests/support/units.py runs it in a browser, tests of the page in jsdom.
export default (words) => {
    const number = /(?<![\w.\-/−+])[+\-−]?\d+(?:[.,]\d+)?(?![\w\-]|\.\d)/g;
    // Dates, times, and year, volume, issue and pages of a cited article.
    const moment = new RegExp([
        '[A-Z][a-z]+ (?:19|20)\\d{2}(?:, \\d+)+', '(?:19|20)\\d{2}; \\d+: \\d+',
        '(?:[A-Z][a-z]+|et al\\.|他) ?(?:19|20)\\d{2}, [A-Z][A-Za-z ]+ \\d+(?:\\(\\d+\\))?, \\d+(?:-\\d+)?',
        '\\d{1,2}:\\d{2}(?::\\d{2})?(?:\\s?[AP]M)?', '\\d{4}-\\d{2}-\\d{2}', '[A-Z][a-z]{2} \\d{1,2}, \\d{4}',
        '\\d{1,2} [A-Z][a-z]{2,} \\d{4}', '\\d{4}年(?:\\d{1,2}月(?:\\d{1,2}日)?)?', '\\d{1,2}/\\d{1,2}',
        // The first day of a period, whose year is at its end; the last day, whose year is at its beginning.
        '[A-Z][a-z]{2,3} \\d{1,2} to(?= [A-Z])', '\\d{1,2} [A-Z][a-z]{2,3} to(?= \\d)', '日〜\\d{1,2}月\\d{1,2}日',
        '(?:[a-z], |revised |et al\\. )(?:19|20)\\d{2}(?=[.,;)])',
    ].join('|'), 'g');
    const any = (list) => '(?:' + list.join('|') + ')';
    const range = '(?:(?:to|of|and|or|–|/|〜|／|±|から|→)\\s?[+\\-−]?[\\d.]+\\s?)*';
    const after = new RegExp('^\\s?' + range + '(?:' + words.units_after + ')');
    const thing = new RegExp('^\\s?(?:(?:of|to) [\\d.]+ )?(?:[a-z]+ )?' + any(words.counted) + '(?![a-z])');
    const place = new RegExp(any(words.placed) + '\\s?$|\\bof\\s?$|^$');
    // "Sessions that were stopped: 0"
    const countedBefore = new RegExp(any([...words.counted, 'runs']) + '(?![a-z])[^.:：]*[:：] ?(?:\\d+ of )?$', 'i');
    // The letters of a unit are not the end of another word.
    const inContext = new RegExp('(?<![A-Za-z])(?:' + words.units_after + ')|' + words.scales);
    const countedHead = new RegExp(any(words.count_heads));
    const found = [];
    const withSpaces = (text) => text.replaceAll('\u00a0', ' ').replaceAll('\u2060', '');
    const headingBefore = (one) => document.evaluate(
        'preceding::*[self::h2 or self::h3][1]', one, null, XPathResult.FIRST_ORDERED_NODE_TYPE).singleNodeValue;

    // Each tick of a figure has its unit in the title of its axis or panel.
    const axisWords = new RegExp('(?<![A-Za-z])(?:' + words.units_after + ')|' + words.scales + '|' + words.axes);
    for (const figure of document.querySelectorAll('.js-plotly-plot')) {
        const layout = figure._fullLayout;
        if (!layout) {
            // Not drawn by Plotly.
            const titles = [...figure.querySelectorAll('.xtitle, .ytitle')].map((one) => one.textContent).join(' | ');
            if (!axisWords.test(withSpaces(titles))) found.push('a figure with the titles "' + titles.slice(0, 150) + '"');
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
            if (!texts.some((one) => axisWords.test(withSpaces(one)))) found.push(`an axis ${name} with the titles "${texts.join(' | ').slice(0, 150)}"`);
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
            const text = withSpaces(block.innerText ?? block.textContent).replace(moment, ' ');
            let context = (block.getAttribute('aria-label') ?? '') + ' ' + (element.closest('figure')?.querySelector('figcaption')?.textContent ?? '');
            const group = element.closest('[role=radiogroup], fieldset, [role=group], section');
            for (const id of (group?.getAttribute('aria-labelledby') ?? '').split(' '))
                context += ' ' + (document.getElementById(id)?.textContent ?? '');
            context += ' ' + (group?.getAttribute('aria-label') ?? '') + ' ' + (group?.querySelector('legend, label')?.textContent ?? '');
            let head = '';
            if (cell) {
                const table = cell.closest('table');
                const column = [...cell.parentElement.children].indexOf(cell);
                const rows = [...table.querySelectorAll('thead tr')];
                head = rows.map((row) => row.children[Math.min(column, row.children.length - 1)]?.textContent ?? '').join(' ');
                context += ' ' + head;
                // The unit of a row's values, at the end of the row's name.
                const names = [...cell.parentElement.children].slice(0, column);
                if (names.some((one) => new RegExp(words.unit_last).test(one.textContent.trim()))) continue;
                // The unit of a row, in a column of its own. A row of texts has none.
                const units = [...(rows[0]?.children ?? [])].findIndex((one) => one.textContent.trim() === words.unit_head);
                const unit = units < 0 ? null : cell.parentElement.children[units].textContent.trim();
                if (unit || (unit === '' && /[^\d.,\s−-]/.test(cell.textContent))) continue;
                context += ' ' + (rows[0]?.children[0]?.textContent ?? '');
                context += ' ' + (headingBefore(table)?.textContent ?? '');
                context += ' ' + (table.querySelector('caption')?.textContent ?? '') + ' ' + (table.getAttribute('aria-label') ?? '');
                context += ' ' + (document.getElementById(table.getAttribute('aria-labelledby'))?.textContent ?? '');
            }
            context = withSpaces(context);
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
}
