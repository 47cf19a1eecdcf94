import { expect, test } from "vitest";
import { DrawingPace } from "./drawingPace";

/** Return how often and for how long a view draws within a minute in which its picture changes all the time. */
function aMinuteOf(drawing_ms: number, inSoftware = false) {
  const pace = new DrawingPace(inSoftware);
  let [now_ms, times, drawn_ms] = [0, 0, 0];
  while (now_ms < 60_000) {
    now_ms += pace.wait_ms(now_ms);
    pace.record(now_ms, now_ms + drawing_ms);
    now_ms += drawing_ms;
    drawn_ms += drawing_ms;
    times += 1;
  }
  return { times, share: drawn_ms / now_ms };
}

test("draws the first picture at once", () => {
  expect(new DrawingPace().wait_ms(0)).toBe(0);
});

test("draws every frame if a drawing takes 2 ms", () => {
  expect(aMinuteOf(2).times).toBeGreaterThan(60 * 60);
});

test("limits slow drawing to a quarter of the time", () => {
  for (const drawing_ms of [20, 100, 300]) expect(aMinuteOf(drawing_ms).share).toBeCloseTo(0.25, 1);
});

test("limits drawing in software to a twentieth of the time, for the control loop on the same computer", () => {
  for (const drawing_ms of [5, 20, 50]) expect(aMinuteOf(drawing_ms, true).share).toBeCloseTo(0.05, 1);
  expect(aMinuteOf(20, true).share).toBeLessThan(0.06);
});

test("delays no picture by more than a second", () => {
  const pace = new DrawingPace();
  pace.record(0, 5000);
  expect(pace.wait_ms(5000)).toBe(1000);
  expect(pace.wait_ms(6000)).toBe(0);
});
