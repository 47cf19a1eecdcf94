import type { Run } from "../../lib/api/client";
import { formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";

type Motion = NonNullable<Run["comparison"]>["motions"][number];

/**
 * Return "5° ± 13° to 92° ± 12°", or null if only the apparatus angle is known. `lowest`: the playback of the
 * lower end; `highest`: the playback of the upper end.
 */
export function describePatientAngle(lowest: Motion, highest = lowest): string | null {
  const { patient_min_deg, patient_min_uncertainty_deg } = lowest;
  const { patient_max_deg, patient_max_uncertainty_deg } = highest;
  if (typeof patient_min_deg !== "number" || typeof patient_max_deg !== "number") return null;
  const end = (angle: number, uncertainty: number | null | undefined) =>
    t("sessions:goniometer.estimate", {
      angle: formatDeg(angle, 0),
      uncertainty: formatDeg(uncertainty, 0),
    });
  return t("common:format.range", {
    from: end(patient_min_deg, patient_min_uncertainty_deg),
    to: end(patient_max_deg, patient_max_uncertainty_deg),
  });
}
