import { expect, it } from "vitest";
import { follow } from "./follow";
import type { Angles } from "./posture";

function moved() {
  let angles: Angles | null = null;
  let notify = () => {};
  const source = {
    get: () => angles,
    subscribe: (listener: () => void) => {
      notify = listener;
      return () => {
        notify = () => {};
      };
    },
  };
  return {
    source,
    to: (first: number | null) => {
      angles = first === null ? null : [first, 0, 0, 0, 0];
      notify();
    },
  };
}

it("draws a moving arm, and lets the picture of a resting one rest", () => {
  const arm = moved();
  const drawn: (number | undefined)[] = [];
  const leave = follow(arm.source, (angles) => drawn.push(angles?.[0]));
  for (const angle of [10, 10.09, 9.95, 10.4, 12]) arm.to(angle);
  expect(drawn).toEqual([undefined, 10, 10.4, 12]);
  leave?.();
  arm.to(40);
  expect(drawn).toHaveLength(4);
});

it("draws a slow motion, however small its steps are", () => {
  const arm = moved();
  const drawn: number[] = [];
  follow(arm.source, (angles) => angles && drawn.push(angles[0]));
  for (let step = 0; step <= 20; step++) arm.to(0.1 * step);
  expect(drawn.length).toBeGreaterThanOrEqual(7);
  expect(2 - (drawn.at(-1) ?? 0)).toBeLessThan(0.3);
});

it("draws at once that the angles are unknown", () => {
  const arm = moved();
  const drawn: (Angles | null)[] = [];
  follow(arm.source, (angles) => drawn.push(angles));
  arm.to(5);
  arm.to(null);
  expect(drawn.at(-1)).toBeNull();
});
