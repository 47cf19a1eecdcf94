import { afterEach, expect, it, vi } from "vitest";
import { lastDays, spanOf } from "./figuresSearch";

afterEach(() => vi.unstubAllEnvs());

it.each(["Asia/Tokyo", "Europe/Berlin", "America/Chicago"])("the last days are local ones in %s", (zone) => {
  vi.stubEnv("TZ", zone);
  // Early morning in Tokyo, when the date in UTC is still that of the previous day.
  const today = new Date(2026, 10, 21, 7, 30);
  const { since, until } = lastDays(7, today);
  expect(new Date(since ?? "")).toEqual(new Date(2026, 10, 15));
  expect(new Date(until ?? "")).toEqual(new Date(2026, 10, 22));
  expect(lastDays(28, today)).toEqual(spanOf({ range: "weeks4" }, today));
});
