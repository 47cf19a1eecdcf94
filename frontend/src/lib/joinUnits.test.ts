import { expect, it } from "vitest";
import { t } from "./i18n";
import { joinUnits } from "./joinUnits";

it.each([
  ["90 % of the range", "90\u00a0% of the range"],
  ["53 to 82 %.", "53\u00a0to\u00a082\u00a0%."],
  ["timer 30 minutes, 2 sessions per week", "timer 30\u00a0minutes, 2\u00a0sessions per week"],
  ["at 100 Hz, 2.5 Nm", "at 100\u00a0Hz, 2.5\u00a0Nm"],
  ["0.3 Nmの誤差", "0.3\u00a0Nmの誤差"],
  ["3 sessions, 4 hours", "3 sessions, 4 hours"],
  ["5 Flexion", "5 Flexion"],
])("joins the numbers of %s with their units", (text, joined) => {
  expect(joinUnits(text)).toBe(joined);
});

const seen = (text: string) => text.replaceAll("\u2060", "|").replaceAll("\u00a0", "_");

it.each([
  ["95 % confidence: −39.0 to −26.6 points.", "95_% confidence: −39.0_to_−26.6 points."],
  ["94 of 114 sessions; 7 of 24 programmes", "94_of_114 sessions; 7_of_24 programmes"],
  ["30° to 60°, 53% to 82%", "30°_to_60°, 53%_to_82%"],
  ["12 Nov 2026, 10:30", "12_Nov_2026, 10:30"],
  ["Nov 12, 2026", "Nov_12,_2026"],
  ["3 Nov 2026 to 30 Nov 2026", "3_Nov_2026 to 30_Nov_2026"],
  ["3 Nov to 30 Nov", "3_Nov to 30_Nov"],
  ["83° ± 5° to 170° ± 6°", "83° ± 5° to 170° ± 6°"],
  ["error [deg]", "error_[deg]"],
  ["Station 2, Motor 5", "Station_2, Motor_5"],
  ["3 sessions of 12, up to 5", "3 sessions of 12, up to 5"],
  ["2026年11月21日 10:30", "2026|年|11|月|21|日 10:30"],
  ["11月21日〜12月5日", "11|月|21|日〜12|月|5|日"],
  ["改善 −39.0〜−26.6点", "改善 −39.0|〜|−26.6|点"],
  ["53〜82%。", "53|〜|82%。"],
  ["30°〜60°", "30°|〜|60°"],
  ["3年、3回", "3|年、3回"],
  ["ステーション1のモータ5", "ステーション|1のモータ|5"],
])("keeps date, range and number together: %s", (text, joined) => {
  expect(seen(joinUnits(text))).toBe(joined);
});

it("is done in every text", () => {
  expect(t("sessions:session.smallestRange", { percent: 80 })).toContain("80\u00a0%");
});
