import { expect, test } from "vitest";
import { toWindow } from "./plotWindow";

test.each([
  [
    { "xaxis.range[0]": 1.5, "xaxis.range[1]": 3 },
    { start_s: 1.5, end_s: 3 },
  ],
  [
    { "xaxis5.range[0]": 1.5, "xaxis5.range[1]": 3 },
    { start_s: 1.5, end_s: 3 },
  ],
  [{ "xaxis.range": [2, 4] }, { start_s: 2, end_s: 4 }],
  [
    { "xaxis.range[0]": -3, "xaxis.range[1]": 3 },
    { start_s: 0, end_s: 3 },
  ],
])("zoom %j gives a window from 0 or later", (change, window) => {
  expect(toWindow(change)).toEqual(window);
});

test.each([
  [{ "xaxis.autorange": true, "yaxis.autorange": true }],
  [{ "xaxis.range[0]": -3, "xaxis.range[1]": -1 }],
])("%j shows the whole figure", (change) => {
  expect(toWindow(change)).toBeNull();
});

test.each([[{ "yaxis.range[0]": 1, "yaxis.range[1]": 2 }], [{ autosize: true }]])(
  "%j does not change the window",
  (change) => {
    expect(toWindow(change)).toBeUndefined();
  },
);
