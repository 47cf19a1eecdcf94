import "./catalogue";
import type { Schemas } from "../../lib/api/client";
import { formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";

type Band = Schemas["RhythmBand"];

const bandRange = (band: Band) => ({
  from: formatDeg(band.from_deg, 0),
  to: formatDeg(band.to_deg, 0),
});
export const bandHead = (band: Band) => t("rhythm:heads.band", bandRange(band));
export const describeRatio = (band: Band) =>
  band.reason ? t(`rhythm:reasons.${band.reason}`) : formatDeg(band.ratio);

/** Return the ratio of the whole pass with its range of elevation, or the reason for its absence. */
export function describeWhole(whole: Band): string {
  if (whole.reason === "not_covered") return t("rhythm:passTooShort");
  const ratio = describeRatio(whole);
  return whole.ratio === null ? ratio : t("rhythm:wholeRatio", { ...bandRange(whole), ratio });
}

/** Return the published ratio for the direction and plane of a curve. */
export function describeReference({ reference }: Schemas["RhythmCurve"]): string {
  if (!reference) return t("rhythm:noReference");
  const words = { ratio: formatDeg(reference.ratio), source: t(`rhythm:sources.${reference.source}.short`) };
  return reference.ratio_deviation === null
    ? t("rhythm:reference", words)
    : t("rhythm:referenceWithDeviation", { ...words, deviation: formatDeg(reference.ratio_deviation) });
}
