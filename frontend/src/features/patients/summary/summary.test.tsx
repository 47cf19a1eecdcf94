import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, within } from "@testing-library/react";
import { afterEach, describe, expect, it, vi } from "vitest";
import { TestRouter } from "../../../app/TestRouter";
import { type Assessment, api, type Schemas } from "../../../lib/api/client";
import * as csv from "../../../lib/csv";
import { timeScale } from "../../../ui/timeScale";
import { ASSESSMENT, FORM } from "../../assessments/examples";
import { readPatientTab } from "../patientTabs";
import { CareTimeline } from "./CareTimeline";
import { stageSpans } from "./careTimeline";
import { RomFigure } from "./RomFigure";
import { radarPoint } from "./romRadar";
import { SinceLastMonth } from "./SinceLastMonth";
import { sinceLastMonth } from "./sinceLastMonth";
import { Trends } from "./Trends";

afterEach(cleanup);

type Entry = Assessment["rom"][number];
const angle = (side: Entry["side"], motion: Entry["motion"], angle_deg: number, of: Partial<Entry> = {}) =>
  ({
    side,
    motion,
    position: motion.endsWith("rotation") ? "at_side" : "",
    kind: "active",
    angle_deg,
    ...of,
  }) as Entry;
const assessed = (day: string, of: Partial<Assessment> = {}): Assessment => ({
  ...ASSESSMENT,
  id: day,
  assessed_at: `${day}T09:30:00Z`,
  ...of,
});
const NEWEST = assessed("2026-11-20");
const show = (shown: React.ReactNode) =>
  render(
    <MantineProvider env="test">
      <TestRouter>{shown}</TestRouter>
    </MantineProvider>,
  );

describe("last month", () => {
  const weeks = [NEWEST, assessed("2026-11-13"), assessed("2026-10-23"), assessed("2026-10-16")];

  it("is the last assessment at least four weeks before the newest", () => {
    expect(sinceLastMonth(weeks, assessed("2026-06-01"))?.before?.id).toBe("2026-10-23");
  });

  it("is the first assessment if none is that old", () => {
    expect(sinceLastMonth(weeks.slice(0, 2), weeks[1] ?? null)?.before?.id).toBe("2026-11-13");
    expect(sinceLastMonth([NEWEST], NEWEST)).toEqual({ newest: NEWEST, before: null });
    expect(sinceLastMonth([], null)).toBeNull();
  });

  it("ignores what was entered by mistake", () => {
    const mistake = assessed("2026-11-24", { withdrawn_at: "2026-11-24T10:00:00Z" });
    expect(sinceLastMonth([mistake, NEWEST], NEWEST)?.newest).toBe(NEWEST);
  });

  it("is shown as values, changes, and what a change of the SPADI means", () => {
    const before = assessed("2026-10-16", {
      rom: [angle("left", "flexion", 90)],
      pain_average: 6,
      spadi_score: { pain: 80, disability: 60, total: 70 },
    });
    show(<SinceLastMonth compared={{ newest: NEWEST, before }} side="left" form={FORM} />);
    const words = screen.getByTestId("since-last-month").textContent;
    expect(words).toContain("Left: Flexion, active105° +15°");
    expect(words).toContain("Pain, average over the last week5 of 10 −1\u00a0point");
    expect(words).toContain(
      "SPADI, 0\u00a0to\u00a010045 of 100 −25\u00a0points Improvement beyond measurement error",
    );
  });

  it("claims no change without an earlier assessment", () => {
    show(<SinceLastMonth compared={{ newest: NEWEST, before: null }} side="left" form={FORM} />);
    expect(screen.getByTestId("since-last-month").textContent).not.toMatch(/ [+−]\d|unchanged/);
  });
});

describe("the range of motion", () => {
  const rom = [
    angle("left", "flexion", 105),
    angle("left", "extension", 30),
    angle("left", "external_rotation", -5),
    angle("right", "flexion", 175),
    angle("left", "flexion", 120, { kind: "passive" }),
  ];
  const figure = (
    <RomFigure
      form={FORM}
      newest={{ ...NEWEST, rom }}
      baseline={assessed("2026-06-01", { rom: [angle("left", "flexion", 80)] })}
      affected="left"
    />
  );
  const cells = (name: string) =>
    within(screen.getByRole("row", { name: new RegExp(name) }))
      .getAllByRole("cell")
      .map((cell) => cell.textContent);

  it("has the angles of both shoulders and the first ones beside the figure", () => {
    show(figure);
    expect(cells("Flexion")).toEqual(["Flexion", "105°", "80°", "175°", "180°"]);
    expect(cells("External rotation")).toEqual(["External rotation", "−5°", "–", "–", "60°"]);
    const saved = vi.spyOn(csv, "saveFile").mockImplementation(() => undefined);
    fireEvent.click(screen.getByRole("button", { name: "Save as CSV" }));
    const [name, text] = saved.mock.calls[0] ?? [];
    expect(name).toBe("range-of-motion.csv");
    expect(text).toContain('"Left, now (°)",First (°),Right (°),Reference (°)');
    expect(text).toContain("External rotation,-5,,,60\r\n");
  });

  it("shows passive angles on request", () => {
    show(figure);
    fireEvent.click(screen.getByRole("radio", { name: "Passive" }));
    expect(cells("Flexion")).toEqual(["Flexion", "120°", "–", "–", "180°"]);
  });

  it("is drawn as shares of the reference, from the centre on", () => {
    expect(radarPoint(180, 180, 0, 4, 120)).toEqual([expect.closeTo(0), expect.closeTo(-100)]);
    expect(radarPoint(90, 180, 1, 4, 120)).toEqual([expect.closeTo(50), expect.closeTo(0)]);
    // An angle below neutral must not appear on the opposite side.
    expect(radarPoint(-60, 60, 1, 4, 120).map(Math.abs)).toEqual([0, 0]);
  });
});

it("trends say in words what they draw, oldest first", () => {
  const rows = [assessed("2026-11-20", { pain_average: 2 }), assessed("2026-10-20", { pain_average: 7 })];
  show(<Trends assessments={rows} side="left" />);
  const pain = within(screen.getByRole("region", { name: "Left shoulder: Pain, 0\u00a0to\u00a010" }));
  expect(pain.getByRole("img").getAttribute("aria-label")).toContain(
    "from 7\u00a0to\u00a02 in 2 assessments",
  );
  fireEvent.click(screen.getByRole("button", { name: "Show numbers" }));
  const table = within(screen.getByRole("table", { name: "Numbers: Left shoulder: Pain and SPADI" }));
  const cells = table.getAllByRole("cell").map((cell) => cell.textContent);
  expect([cells[1], cells[4]]).toEqual(["7.0", "2.0"]);
});

it("the timeline has only the sessions of its shoulder", async () => {
  const session = (id: string, episode_id: string) => ({
    id,
    episode_id,
    started_at: "2026-11-02T09:30:00Z",
    stops: 0,
  });
  vi.spyOn(api, "patientSessions").mockResolvedValue({
    items: [session("1", "left"), session("2", "right")],
    next: null,
  } as never);
  const episode = {
    id: "left",
    patient_id: "p",
    opened_at: "2026-11-01T00:00:00Z",
    closed_at: null,
    stages: [],
    stage: null,
  };
  show(
    <QueryClientProvider client={new QueryClient()}>
      <CareTimeline episode={episode as never} assessments={[]} />
    </QueryClientProvider>,
  );
  expect(await screen.findByText(/^1 session/)).toBeTruthy();
});

it("a stage lasts until the next one", () => {
  const stage = (stage: "freezing" | "frozen", since: string) =>
    ({ id: since, stage, since }) as Schemas["Episode"]["stages"][number];
  expect(stageSpans([stage("frozen", "2026-09-01"), stage("freezing", "2026-06-01")], "2026-11-25")).toEqual([
    { stage: "freezing", from: "2026-06-01", to: "2026-09-01" },
    { stage: "frozen", from: "2026-09-01", to: "2026-11-25" },
  ]);
});

it("a scale of time spreads its moments, and puts a single one at the end", () => {
  const scale = timeScale(["2026-11-03T00:00:00Z", "2026-11-01T00:00:00Z"], 10, 110);
  expect([scale("2026-11-01T00:00:00Z"), scale("2026-11-02T00:00:00Z"), scale(scale.ends[1] ?? "")]).toEqual([
    10, 60, 110,
  ]);
  expect(timeScale(["2026-11-01T00:00:00Z"], 10, 110)("2026-11-01T00:00:00Z")).toBe(110);
});

it.each([
  [{ tab: "data" }, { tab: "data" }],
  [{ tab: "summary" }, {}],
  [{ tab: "x" }, {}],
])("an address with %j opens %j", (search, read) => expect(readPatientTab(search)).toEqual(read));
