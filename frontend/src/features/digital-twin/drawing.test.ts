import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { viewOf } from "./camera";
import { Drawing, LATE_AFTER_MS } from "./drawing";
import type { Angles } from "./posture";
import type { Picture, WorkerMessage, WorkerSetup } from "./scene/picture";

const AT: Angles = [1, 2, 3, 4, 5];
const FIRST = {
  width: 300,
  height: 200,
  view: viewOf("corner", "right"),
  scheme: "light" as const,
  only: null,
  real: null,
  ghost: null,
};

/** A worker that draws when the test calls `draw`. */
class FakeWorker {
  readonly pictures: Picture[] = [];
  onmessage: ((event: { data: WorkerMessage }) => void) | null = null;
  onerror: (() => void) | null = null;
  ended = false;

  postMessage(message: WorkerSetup | Picture) {
    if ("number" in message) this.pictures.push(message);
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

function startDrawing() {
  const worker = new FakeWorker();
  const reports: string[] = [];
  const onDrawn = vi.fn();
  const drawing = new Drawing(worker as unknown as Worker, {} as WorkerSetup, FIRST, {
    onLate: (late) => reports.push(late ? "late" : "in time"),
    onUnable: () => reports.push("unable"),
    onDrawn,
  });
  return { worker, reports, drawing, onDrawn };
}

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

test("sends complete pictures, so the newest suffices", () => {
  const { worker, drawing } = startDrawing();
  drawing.change({ real: AT });
  drawing.change({ only: 3 });
  expect(worker.newest()).toEqual({ ...FIRST, real: AT, only: 3, number: 2 });
});

test("reports a drawn picture", () => {
  const { worker, onDrawn } = startDrawing();
  expect(onDrawn).not.toHaveBeenCalled();
  worker.draw();
  expect(onDrawn).toHaveBeenCalledOnce();
});

test("sends an unknown pose like any other", () => {
  const { worker, drawing } = startDrawing();
  drawing.change({ real: AT });
  drawing.change({ real: null });
  expect(worker.newest().real).toBeNull();
});

test("reports a picture late after two seconds until drawn", () => {
  const { worker, reports, drawing } = startDrawing();
  worker.draw();
  drawing.change({ real: AT });
  vi.advanceTimersByTime(LATE_AFTER_MS - 1);
  expect(reports).toEqual([]);
  vi.advanceTimersByTime(1);
  expect(reports).toEqual(["late"]);
  worker.draw();
  expect(reports).toEqual(["late", "in time"]);
});

test("reports late although newer pictures keep arriving", () => {
  const { reports, drawing } = startDrawing();
  for (let n = 0; n < 30; n += 1) {
    drawing.change({ real: AT });
    vi.advanceTimersByTime(LATE_AFTER_MS / 20);
  }
  expect(reports).toEqual(["late"]);
});

test("does not report slow but steady drawing", () => {
  const { worker, reports, drawing } = startDrawing();
  for (let n = 0; n < 30; n += 1) {
    const asked = worker.newest().number;
    drawing.change({ real: AT });
    vi.advanceTimersByTime(LATE_AFTER_MS / 2);
    worker.onmessage?.({ data: { drawn: asked } });
  }
  expect(reports).toEqual([]);
});

test("reports nothing without a change", () => {
  const { worker, reports } = startDrawing();
  worker.draw();
  vi.advanceTimersByTime(10 * LATE_AFTER_MS);
  expect(reports).toEqual([]);
});

test("reports a worker that cannot draw or fails", () => {
  const cannot = startDrawing();
  cannot.worker.onmessage?.({ data: { unable: true } });
  expect(cannot.reports).toEqual(["unable"]);
  const breaks = startDrawing();
  breaks.worker.onerror?.();
  expect(breaks.reports).toEqual(["unable"]);
});

test("stops the worker and all reports when closed", () => {
  const { worker, reports, drawing } = startDrawing();
  drawing.change({ real: AT });
  drawing.close();
  vi.advanceTimersByTime(10 * LATE_AFTER_MS);
  expect(worker.ended).toBe(true);
  expect(reports).toEqual([]);
});
