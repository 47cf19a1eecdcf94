import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { BEHIND_AFTER_MS, Drawing } from "./drawing";
import type { Angles } from "./posture";
import type { Answer, Beginning, Picture } from "./scene/picture";
import { viewOf } from "./view";

const AT: Angles = [1, 2, 3, 4, 5];
const FIRST = {
  width: 300,
  height: 200,
  view: viewOf("corner", "right"),
  only: null,
  real: null,
  ghost: null,
};

/** Draws when it is told to. */
class Draws {
  readonly pictures: Picture[] = [];
  onmessage: ((event: { data: Answer }) => void) | null = null;
  onerror: (() => void) | null = null;
  ended = false;

  postMessage(what: Beginning | Picture) {
    if ("number" in what) this.pictures.push(what);
  }

  draw() {
    this.onmessage?.({ data: { drawn: this.newest().number } });
  }

  newest(): Picture {
    return this.pictures.at(-1) as Picture;
  }

  terminate() {
    this.ended = true;
  }
}

function begun() {
  const worker = new Draws();
  const told: string[] = [];
  const drawing = new Drawing(worker as unknown as Worker, {} as Beginning, FIRST, {
    onBehind: (behind) => told.push(behind ? "behind" : "in time"),
    onUnable: () => told.push("unable"),
  });
  return { worker, told, drawing };
}

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

test("sends complete pictures, so the newest suffices", () => {
  const { worker, drawing } = begun();
  drawing.change({ real: AT });
  drawing.change({ only: 3 });
  expect(worker.newest()).toEqual({ ...FIRST, real: AT, only: 3, number: 2 });
});

test("sends an unknown pose like any other", () => {
  const { worker, drawing } = begun();
  drawing.change({ real: AT });
  drawing.change({ real: null });
  expect(worker.newest().real).toBeNull();
});

test("reports a picture late after two seconds until drawn", () => {
  const { worker, told, drawing } = begun();
  worker.draw();
  drawing.change({ real: AT });
  vi.advanceTimersByTime(BEHIND_AFTER_MS - 1);
  expect(told).toEqual([]);
  vi.advanceTimersByTime(1);
  expect(told).toEqual(["behind"]);
  worker.draw();
  expect(told).toEqual(["behind", "in time"]);
});

test("newer pictures do not hide that none is drawn", () => {
  const { told, drawing } = begun();
  for (let n = 0; n < 30; n += 1) {
    drawing.change({ real: AT });
    vi.advanceTimersByTime(BEHIND_AFTER_MS / 20);
  }
  expect(told).toEqual(["behind"]);
});

test("slow drawing is not late while it progresses", () => {
  const { worker, told, drawing } = begun();
  for (let n = 0; n < 30; n += 1) {
    const asked = worker.newest().number;
    drawing.change({ real: AT });
    vi.advanceTimersByTime(BEHIND_AFTER_MS / 2);
    worker.onmessage?.({ data: { drawn: asked } });
  }
  expect(told).toEqual([]);
});

test("nothing is late without a change", () => {
  const { worker, told } = begun();
  worker.draw();
  vi.advanceTimersByTime(10 * BEHIND_AFTER_MS);
  expect(told).toEqual([]);
});

test("reports a worker that cannot draw or fails", () => {
  const cannot = begun();
  cannot.worker.onmessage?.({ data: { unable: true } });
  expect(cannot.told).toEqual(["unable"]);
  const breaks = begun();
  breaks.worker.onerror?.();
  expect(breaks.told).toEqual(["unable"]);
});

test("stops the worker and all reports when closed", () => {
  const { worker, told, drawing } = begun();
  drawing.change({ real: AT });
  drawing.close();
  vi.advanceTimersByTime(10 * BEHIND_AFTER_MS);
  expect(worker.ended).toBe(true);
  expect(told).toEqual([]);
});
