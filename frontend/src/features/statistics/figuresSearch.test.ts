import { afterEach, expect, it } from "vitest";
import { setClinicZone } from "../../lib/days";
import { spanOf } from "./figuresSearch";

afterEach(() => setClinicZone("UTC"));

it.each([
  ["Asia/Tokyo", "2026-11-14T15:00:00.000Z", "2026-11-21T15:00:00.000Z"],
  ["Europe/Berlin", "2026-11-13T23:00:00.000Z", "2026-11-20T23:00:00.000Z"],
  ["America/Chicago", "2026-11-14T06:00:00.000Z", "2026-11-21T06:00:00.000Z"],
])("the last days are those of the clinic in %s", (zone, begin, end) => {
  setClinicZone(zone);
  // Early morning in Tokyo, when the date in UTC is still that of the previous day.
  const today = new Date("2026-11-20T22:30:00Z");
  const { since, until } = spanOf({ range: "days7" }, today);
  expect([since, until]).toEqual([begin, end]);
});
