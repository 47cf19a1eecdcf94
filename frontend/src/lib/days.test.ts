import { globSync, readFileSync } from "node:fs";
import { afterEach, expect, it, vi } from "vitest";
import {
  addDays,
  dayOf,
  fromLocalDateTime,
  isZoneMissing,
  midnight,
  setClinicZone,
  toLocalDateTime,
} from "./days";
import { formatAfter, formatClock, formatDay, formatDayOf, formatMoment, formatShortDays } from "./format";

afterEach(() => setClinicZone("UTC"));

/** Late in the evening in UTC, and the morning of the next day in Tokyo. */
const EVENING = "2026-11-20T22:30:05Z";

it("shows every day and time in the clinic's zone", () => {
  setClinicZone("Asia/Tokyo");
  expect(formatDayOf(EVENING)).toBe("Nov\u00a021,\u00a02026");
  expect(formatMoment(EVENING)).toMatch(/^Nov\u00a021,\u00a02026, 0?7:30\sAM$/);
  expect(formatAfter("2026-11-20T23:00:00Z", EVENING)).toMatch(/^0?8:00\sAM$/);
  expect(formatClock(new Date(EVENING))).toMatch(/^0?7:30:05\sAM$/);
  expect(formatShortDays(["2026-12-31T20:00:00Z", "2027-02-01T00:00:00Z"])).toEqual([
    "Jan\u00a01",
    "Feb\u00a01",
  ]);
  expect(formatDay("2026-11-20")).toBe("Nov\u00a020,\u00a02026");
  setClinicZone("America/Chicago");
  expect(formatDayOf(EVENING)).toBe("Nov\u00a020,\u00a02026");
  expect(formatDay("2026-11-20")).toBe("Nov\u00a020,\u00a02026");
});

it.each(["", "Mars/Olympus"])("shows and states UTC if the clinic's zone is %j", (name) => {
  vi.stubEnv("TZ", "Asia/Tokyo");
  try {
    expect(new Date(EVENING).getDate()).toBe(21);
    setClinicZone(name);
    expect(isZoneMissing()).toBe(true);
    expect(formatDayOf(EVENING)).toBe("Nov\u00a020,\u00a02026");
    expect(formatMoment(EVENING)).toMatch(/^Nov\u00a020,\u00a02026, 10:30\sPM UTC$/);
    expect(formatClock(new Date(EVENING))).toMatch(/^10:30:05\sPM UTC$/);
    // The value of a form's field has no zone.
    expect(toLocalDateTime(new Date(EVENING))).toBe("2026-11-20T22:30");
    setClinicZone("UTC");
    expect(isZoneMissing()).toBe(false);
    expect(formatMoment(EVENING)).toMatch(/^Nov\u00a020,\u00a02026, 10:30\sPM$/);
  } finally {
    vi.unstubAllEnvs();
  }
});

it.each(["Asia/Tokyo", "America/St_Johns", "Europe/Paris", "Pacific/Kiritimati", "UTC"])(
  "reads a typed time of %s as it shows it",
  (zone) => {
    setClinicZone(zone);
    // Almost every day of two years, at another hour each day.
    for (let moment = Date.UTC(2025, 0, 1); moment < Date.UTC(2027, 0, 1); moment += 1433 * 60_000) {
      const shown = toLocalDateTime(moment);
      expect(toLocalDateTime(fromLocalDateTime(shown))).toBe(shown);
      const day = dayOf(moment);
      expect(dayOf(Date.parse(midnight(day, 0)))).toBe(day);
      expect(toLocalDateTime(Date.parse(midnight(day, 1)))).toBe(`${addDays(day, 1)}T00:00`);
    }
  },
);

it("no other module asks the browser for days", () => {
  const inBrowsersZone =
    /\.(?:get|set)(?:FullYear|Month|Date|Day|Hours|Minutes|TimezoneOffset)\(|\.toLocale(?:Date|Time)?String\(|T00:00[`"]|new Date\(\d{4}|Intl\.DateTimeFormat/;
  const sources = globSync("src/**/*.{ts,tsx}").filter((name) => !/\.test\.tsx?$/.test(name));
  expect(sources.length).toBeGreaterThan(300);
  const allowed = ["src/lib/days.ts", "src/lib/format.ts"];
  const found = sources.filter(
    (name) => !allowed.includes(name) && inBrowsersZone.test(readFileSync(name, "utf8")),
  );
  expect(found).toEqual([]);
});
