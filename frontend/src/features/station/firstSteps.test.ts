import { describe, expect, it } from "vitest";
import type { Session } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { type FirstStep, firstStep } from "./firstSteps";
import { FRESH } from "./session-wizard/examples";

const CHECKS = ["identity", "side", "fixtures", "belt"].map((check) => ({ check })) as Session["checks"];
const checked = { ...FRESH, checks: CHECKS };
const asked = { ...checked, pain_before: 4 };
const run = (ended_at: string | null) => [{ ended_at }] as Session["runs"];
const playing = { ...asked, runs: run(null) };
const played = { ...asked, runs: run("2026-11-22T08:50:00Z") };

describe("a new user of the simulated apparatus", () => {
  it.each<[FirstStep, number, boolean, number, Parameters<typeof firstStep>[0]["session"]]>([
    ["sign_up", 0, false, 0, null],
    ["choose", 1, false, 0, null],
    ["teach", 1, true, 0, null],
    // A session can start before any teaching.
    ["teach", 1, true, 0, FRESH],
    ["begin", 1, true, 1, null],
    ["begin", 1, true, 1, FRESH],
    ["begin", 1, true, 1, checked],
    ["play", 1, true, 1, asked],
    ["play", 1, true, 1, playing],
    ["look", 1, true, 1, played],
    ["look", 1, true, 1, { ...played, ended_at: "2026-11-22T09:00:00Z" }],
    // The guide starts again for a patient's next session.
    ["begin", 1, true, 1, { ...asked, ended_at: "2026-11-22T09:00:00Z" }],
  ])(
    "sees step %s with %i patients, chosen: %s, %i recordings",
    (step, patients, chosen, recordings, session) => {
      expect(firstStep({ patients, chosen, recordings, session })).toBe(step);
    },
  );
});

it("lets a new user turn the apparatus before the emergency stop is tested", () => {
  // After the apparatus was turned, the test must be repeated.
  expect(t("station:firstStepTexts.teach")).toMatch(/other shoulder.*test the emergency stop/);
});
