import type { Schemas } from "../../lib/api/client";

export type Point = Schemas["RetouchPoint"];
/** A changed part of a motion: two marks, and the points between them. */
export type Part = Pick<Schemas["Retouch"], "start_s" | "end_s" | "points">;

/** Bounds of the service. */
const GAP_S = 0.2;
export const MOST_DEG = 30;
const MOST_POINTS = 20;
const STEEPEST = 1.25;

type Knot = { at_s: number; change_deg: number };

/** Return marks and points of a motor in order of time. The change at both marks is 0. */
export function knotsOf(part: Part, motor: number): Knot[] {
  const points = part.points.filter((point) => point.motor === motor);
  const inOrder = points.toSorted((one, other) => one.at_s - other.at_s);
  return [{ at_s: part.start_s, change_deg: 0 }, ...inOrder, { at_s: part.end_s, change_deg: 0 }];
}

/**
 * Return the change of a motor in degrees at a time. It is a sketch of the curve that the service makes
 * (kata.motion.retouch): polynomials of degree 5 in Bernstein form.
 */
export function changeAt(knots: Knot[], time_s: number): number {
  const n = knots.findIndex((knot) => knot.at_s > time_s);
  const [from, to] = [knots[n - 1], knots[n]];
  if (!from || !to) return 0;
  const span_s = to.at_s - from.at_s;
  const start = (slopeAt(knots, n - 1) * span_s) / 5;
  const end = (slopeAt(knots, n) * span_s) / 5;
  const [a, b] = [from.change_deg, to.change_deg];
  let values = [a, a + start, a + 2 * start, b - 2 * end, b - end, b];
  const x = (time_s - from.at_s) / span_s;
  // De Casteljau's algorithm.
  while (values.length > 1)
    values = values.slice(1).map((value, i) => (values[i] ?? 0) * (1 - x) + value * x);
  return values[0] ?? 0;
}

function slopeAt(knots: Knot[], n: number): number {
  const [before, here, after] = [knots[n - 1], knots[n], knots[n + 1]];
  if (!before || !here || !after) return 0;
  const one = (here.change_deg - before.change_deg) / (here.at_s - before.at_s);
  const other = (after.change_deg - here.change_deg) / (after.at_s - here.at_s);
  if (!(one * other > 0)) return 0;
  const mean = (2 * one * other) / (one + other);
  return Math.sign(mean) * Math.min(Math.abs(mean), STEEPEST * Math.min(Math.abs(one), Math.abs(other)));
}

/** Return a new point of a motor in the middle of the longest gap, on the curve, or null if there is no room. */
export function newPoint(part: Part, motor: number): Point | null {
  if (part.points.length >= MOST_POINTS) return null;
  const knots = knotsOf(part, motor);
  const gaps = knots.slice(1).map((knot, n) => ({ n, span_s: knot.at_s - (knots[n]?.at_s ?? 0) }));
  const longest = gaps.reduce((one, other) => (other.span_s > one.span_s + 1e-9 ? other : one));
  const from = knots[longest.n];
  if (!from || longest.span_s < 2 * GAP_S + 0.1) return null;
  const at_s = toTenth(from.at_s + longest.span_s / 2);
  return { motor, at_s, change_deg: Math.round(2 * changeAt(knots, at_s)) / 2 };
}

/** Return the times between which a point can be moved: between its neighbours. */
export function roomOf(part: Part, place: number): { min: number; max: number } {
  const point = part.points[place];
  if (!point) return { min: part.start_s, max: part.end_s };
  const others = knotsOf({ ...part, points: part.points.filter((_, n) => n !== place) }, point.motor);
  const next = others.findIndex((knot) => knot.at_s > point.at_s);
  const after = others[next === -1 ? others.length - 1 : Math.max(1, next)];
  const before = others[next === -1 ? others.length - 2 : Math.max(0, next - 1)];
  return {
    min: toTenth((before?.at_s ?? part.start_s) + GAP_S),
    max: toTenth((after?.at_s ?? part.end_s) - GAP_S),
  };
}

/** Return the times between which the marks can be moved. A mark does not pass a point. */
export function marksRoom(part: Part, duration_s: number) {
  const times = part.points.map((point) => point.at_s);
  return {
    start: { min: 0, max: toTenth(Math.min(part.end_s - GAP_S, ...times) - GAP_S) },
    end: {
      min: toTenth(Math.max(part.start_s + GAP_S, ...times) + GAP_S),
      max: Math.floor(duration_s * 10) / 10,
    },
  };
}

export const toTenth = (time_s: number) => Math.round(time_s * 10) / 10;
export const toHalf = (deg: number) => Math.round(deg * 2) / 2;
export const clamp = (value: number, { min, max }: { min: number; max: number }) =>
  Math.max(min, Math.min(max, value));

/** Return the part of a new retouch: the middle half of the motion, without points. */
export const wholePart = (duration_s: number): Part => ({
  start_s: toTenth(duration_s / 4),
  end_s: toTenth((3 * duration_s) / 4),
  points: [],
});

/** Return true if every number is entered and something changes. The service checks the rest. */
export const isComplete = (part: Part) =>
  part.points.some((point) => point.change_deg !== 0) &&
  [part.start_s, part.end_s, ...part.points.flatMap((point) => [point.at_s, point.change_deg])].every(
    Number.isFinite,
  );
