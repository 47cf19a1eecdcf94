import { expect, it } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { describeDrift } from "./drift";

const KNOWN = {
  station: "Kata 1",
  playbacks: 9,
  rmse_deg: 1,
  before_deg: 1,
  change_deg: { value: 0, low: -0.1, high: 0.1 },
  drifting: false,
} as unknown as Schemas["StationDrift"];
const UNKNOWN = { ...KNOWN, station: "Kata 2", playbacks: 0, rmse_deg: null, change_deg: null };

it("calls the tracking error steady only if it is known", () => {
  expect(describeDrift([])).toBe("Too few playbacks");
  expect(describeDrift([UNKNOWN])).toBe("Too few playbacks");
  expect(describeDrift([UNKNOWN, KNOWN])).toBe("Steady");
  expect(describeDrift([KNOWN, { ...KNOWN, station: "Kata 3", drifting: true }])).toBe("Kata 3: rising");
});
