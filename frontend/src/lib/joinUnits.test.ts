import { expect, it } from "vitest";
import { t } from "./i18n";
import { joinUnits } from "./joinUnits";

it.each([
  ["90 % of the range", "90\u00a0% of the range"],
  ["53 to 82 %.", "53 to 82\u00a0%."],
  ["timer 30 minutes, 2 sessions per week", "timer 30\u00a0minutes, 2\u00a0sessions per week"],
  ["at 100 Hz, 2.5 Nm", "at 100\u00a0Hz, 2.5\u00a0Nm"],
  ["0.3 Nmの誤差", "0.3\u00a0Nmの誤差"],
  ["3 sessions, 4 hours", "3 sessions, 4 hours"],
  ["5 Flexion", "5 Flexion"],
])("joins the numbers of %s with their units", (text, joined) => {
  expect(joinUnits(text)).toBe(joined);
});

const seen = (text: string) => text.replaceAll("\u2060", "|");

it.each([
  ["2026年11月21日 10:30", "2026|年|11|月|21|日 10:30"],
  ["11月21日〜12月5日", "11|月|21|日〜12|月|5|日"],
  ["改善 −39.0〜−26.6点", "改善 −39.0|〜|−26.6|点"],
  ["53〜82%。", "53|〜|82%。"],
  ["30°〜60°", "30°|〜|60°"],
  ["3年、3回", "3|年、3回"],
])("keeps date and range together: %s", (text, joined) => {
  expect(seen(joinUnits(text))).toBe(joined);
});

it("is done in every text", () => {
  expect(t("sessions:session.smallestRange", { percent: 80 })).toContain("80\u00a0%");
});
