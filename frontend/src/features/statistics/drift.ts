import type { Schemas } from "../../lib/api/client";
import { formatList } from "../../lib/format";
import { t } from "../../lib/i18n";

/** Return the stations whose tracking error rises, or that it is steady, or that too little was played to know. */
export function describeDrift(drift: Schemas["StationDrift"][]): string {
  const rising = drift.filter((station) => station.drifting).map((station) => station.station);
  if (rising.length > 0) return t("statistics:figures.trackingDrift", { stations: formatList(rising) });
  const known = drift.some((station) => station.change_deg);
  return known ? t("statistics:figures.trackingSteady") : t("statistics:figures.unknown");
}
