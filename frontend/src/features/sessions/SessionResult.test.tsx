import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import i18next from "i18next";
import { afterEach, expect, it } from "vitest";
import type { Session } from "../../lib/api/client";
import japanese from "../../locales/ja";
import { ResultMetrics } from "./SessionResult";

for (const [namespace, texts] of Object.entries(japanese)) i18next.addResourceBundle("ja", namespace, texts);

const SESSION = {
  side: "left",
  pain_before: 5,
  pain_during: null,
  pain_after: 4,
  runs: [
    {
      outcome: "completed",
      side: "left",
      partial: false,
      repetitions: 3,
      repetitions_done: 3,
      reversals: 0,
      comparison: {
        motors: [{ motor: 4, peak_deg: 1.2 }],
        motions: [
          {
            motion: 4,
            name: "Abduction",
            taught_min_deg: 0,
            taught_max_deg: 80,
            played_min_deg: 5,
            played_max_deg: 78,
            end_range_s: 12,
            end_range_band_deg: 10,
            end_range_torque_nm: 0.5,
          },
        ],
      },
    },
  ],
} as unknown as Session;

async function show(language: "en" | "ja", session: Session) {
  await i18next.changeLanguage(language);
  render(
    <MantineProvider env="test">
      <ResultMetrics session={session} />
    </MantineProvider>,
  );
}

const words = (testid: string) => screen.getByTestId(testid).textContent ?? "";

afterEach(async () => {
  cleanup();
  await i18next.changeLanguage("en");
});

it.each([
  ["en", "Left shoulder", "The apparatus angle is not the patient's angle: the arm can slip in its cuff."],
  ["ja", "左肩", "装置角度は患者の角度ではありません。腕は固定具の中で滑ることがあります。"],
] as const)(
  "in %s the reached range has the shoulder and the caveat of slip",
  async (language, shoulder, slip) => {
    await show(language, SESSION);
    expect(words("result-range")).toContain("78.0°");
    expect(words("result-range")).toContain(shoulder);
    expect(words("result-range")).toContain(slip);
    expect(words("result-end-range")).toContain(shoulder);
  },
);

it.each([
  ["en", "Shoulder not known"],
  ["ja", "肩の側は不明"],
] as const)("in %s a range without a known shoulder says so", async (language, unknown) => {
  await show(language, { ...SESSION, side: null });
  expect(words("result-range")).toContain(unknown);
});

it("counts no repetition of an end-feel test", async () => {
  const [played] = SESSION.runs;
  const measured = { ...played, repetitions: 1, repetitions_done: null, end_feel: "test", comparison: null };
  await show("en", { ...SESSION, runs: [played, measured] } as Session);
  expect(screen.getByText("3 of 3")).toBeTruthy();
});

it("without a range there is nothing to qualify", async () => {
  await show("en", { ...SESSION, runs: [] });
  expect(words("result-range")).toBe("Apparatus angle reached–");
});
