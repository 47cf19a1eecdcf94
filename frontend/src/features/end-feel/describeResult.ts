import "./catalogue";
import type { Schemas } from "../../lib/api/client";
import { formatDeg, formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";

/** Return the result of a test in words: range, onset and stiffness with their intervals, or why there are none. */
export function describeResult(test: Schemas["EndFeelRecord"]): string {
  const { figures, interval, unmeasured } = test;
  if (unmeasured) return t(`endFeel:unmeasured.${unmeasured}`);
  if (!figures || !interval) return t(test.outcome === "loaded" ? "endFeel:running" : "endFeel:noResult");
  return t("endFeel:result", {
    torque: formatDeg(0.6 * test.torque_nm, 1),
    angle: formatDeg(figures.range_deg, 1),
    half: formatDeg(interval.range_deg, 1),
    onset: formatDeg(figures.onset_deg, 1),
    stiffness: formatDeg(figures.stiffness_nm_deg, 3),
  });
}

/** Return what a stretch did, in words. */
export function describeStretch(stretch: NonNullable<Schemas["EndFeelRecord"]["stretch"]>): string {
  if (stretch.held_s === null || stretch.target_nm === null) return t("endFeel:stretch.running");
  return t("endFeel:stretch.result", {
    time: formatDuration(Math.round(stretch.held_s)),
    torque: formatDeg(stretch.target_nm, 1),
    repetitions: stretch.repetitions,
    hold: formatDeg(stretch.hold_s, 0),
    largest: formatDeg(stretch.largest_deg, 0),
  });
}
