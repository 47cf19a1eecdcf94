import type { Schemas } from "../../lib/api/client";
import { formatDeg, formatDegrees } from "../../lib/format";
import { t } from "../../lib/i18n";
import type { Measure } from "./figuresSearch";

/** Return a share in whole percent. */
export const wholePercent = (share: number) => (100 * share).toFixed(0);

/** Return true if a measure is a score, and false if it is an angle. */
export const hasPoints = (measure: Measure) => measure === "spadi" || measure === "pain";

/** Return a value or a change of a measure with its unit. */
export const withUnit = (measure: Measure, value: number | null | undefined) =>
  hasPoints(measure)
    ? t("statistics:verdicts.points", { value: formatDeg(value) })
    : formatDegrees(value ?? null);

/** Return how a measure changed in all shoulders, or undefined if there are too few patients. */
export const changeOfAll = (found: Schemas["Outcomes"], measure: Measure) =>
  found.groups.find((group) => group.by === "all")?.changes.find((change) => change.measure === measure);
