import { describe, expect, it } from "vitest";
import { trendPath } from "./DriveHealth";

const point = (second: number, temperature: number | null) => ({
  at: `2026-11-25T10:00:0${second}Z`,
  voltage_v: [12, 12, 12, 12, 12],
  temperature_c: [30, temperature, 30, 30, 30],
});

describe("the course of a temperature", () => {
  it("spans the chart and rises with the temperature", () => {
    expect(trendPath([point(0, 30), point(5, 40)], 2)).toBe("M0.0 19.0L120.0 1.0");
  });

  it("leaves a gap where the temperature is unknown", () => {
    const path = trendPath([point(0, 30), point(2, null), point(4, 50), point(8, 50)], 2);
    expect(path).toBe("M0.0 19.0M60.0 1.0L120.0 1.0");
  });

  it("draws a change of one degree small", () => {
    expect(trendPath([point(0, 30), point(8, 31)], 2)).toBe("M0.0 19.0L120.0 17.2");
  });

  it("is empty without a known temperature", () => {
    expect(trendPath([point(0, null)], 2)).toBe("");
    expect(trendPath([], 2)).toBe("");
  });
});
