import { expect, it } from "vitest";
import { changeAt, newPoint, type Part, roomOf } from "./retouch";

const KNOTS = [
  [1, 0],
  [2, -3],
  [2.5, -8],
  [4, 2],
  [5, 0],
].map(([at_s = 0, change_deg = 0]) => ({ at_s, change_deg }));
const PART: Part = {
  start_s: 1,
  end_s: 5,
  points: KNOTS.slice(1, -1).map((knot) => ({ ...knot, motor: 3 })),
};

it("draws the curve that the service makes", () => {
  // Computed with kata.motion.retouch.change_deg.
  const made = [-0.0922, -2.6189, -4.9436, -8.0, -4.8256, 1.9733, 0.6349];
  const times = [1.2, 1.9, 2.2, 2.5, 3.1, 3.9, 4.6];
  times.forEach((time_s, n) => {
    expect(changeAt(KNOTS, time_s)).toBeCloseTo(made[n] ?? Number.NaN, 4);
  });
  expect([changeAt(KNOTS, 0.5), changeAt(KNOTS, 5.5)]).toEqual([0, 0]);
});

it("adds a point in the longest gap, on the curve, and keeps points apart", () => {
  expect(newPoint(PART, 3)).toEqual({ motor: 3, at_s: 3.3, change_deg: -2.5 });
  expect(newPoint({ ...PART, end_s: 1.4, points: [] }, 3)).toBeNull();
  expect(roomOf(PART, 1)).toEqual({ min: 2.2, max: 3.8 });
  expect(roomOf(PART, 0)).toEqual({ min: 1.2, max: 2.3 });
});
