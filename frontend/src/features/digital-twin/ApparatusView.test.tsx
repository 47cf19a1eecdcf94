import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { ApparatusView } from "./ApparatusView";
import type { Scheme } from "./colours";
import type { Picture, WorkerSetup } from "./scene/picture";

let pictures: Picture[] = [];
let workers = 0;
class FakeWorker {
  constructor() {
    workers += 1;
  }
  postMessage(message: WorkerSetup | Picture) {
    if ("number" in message) pictures.push(message);
  }
  terminate() {}
}

const view = (scheme: Scheme, max_deg = 90) => (
  <MantineProvider env="test" forceColorScheme={scheme}>
    <ApparatusView
      side="right"
      limits={[{ min_deg: -90, max_deg }]}
      real={null}
      ghost={null}
      label="Apparatus"
    />
  </MantineProvider>
);

beforeEach(() => {
  pictures = [];
  workers = 0;
  vi.stubGlobal("Worker", FakeWorker);
  HTMLCanvasElement.prototype.transferControlToOffscreen = () => ({}) as OffscreenCanvas;
});
afterEach(() => {
  cleanup();
  vi.unstubAllGlobals();
  Reflect.deleteProperty(HTMLCanvasElement.prototype, "transferControlToOffscreen");
});

it("draws in the page's scheme, and again when it changes", () => {
  const { rerender } = render(view("dark"));
  expect(pictures.at(-1)?.scheme).toBe("dark");
  rerender(view("light"));
  expect(pictures.at(-1)?.scheme).toBe("light");
});

it("keeps its picture when the same limits arrive again, as after each reconnection", () => {
  const { rerender } = render(view("light"));
  const canvas = () => screen.getByTestId("apparatus-canvas").querySelector("canvas");
  const first = canvas();
  rerender(view("light"));
  expect(workers).toBe(1);
  expect(canvas()).toBe(first);
  rerender(view("light", 80));
  expect(workers).toBe(2);
  expect(canvas()).not.toBe(first);
});

it("has the background and the discs of the scheme", () => {
  const { rerender } = render(view("light"));
  const background = () => screen.getByTestId("apparatus-canvas").parentElement?.style.background;
  const disc = () => screen.getByRole("button", { name: /^4/ }).querySelector("span")?.style.background;
  const [light, lightDisc] = [background(), disc()];
  rerender(view("dark"));
  expect(background()).toContain("linear-gradient");
  expect(background()).not.toBe(light);
  expect(disc()).not.toBe(lightDisc);
});

it("says on the scheme's background that the browser cannot draw", () => {
  vi.stubGlobal("Worker", undefined);
  const { rerender } = render(view("light"));
  const background = () => screen.getByText(/cannot draw in 3D/).parentElement?.style.background;
  const light = background();
  rerender(view("dark"));
  expect(background()).toContain("linear-gradient");
  expect(background()).not.toBe(light);
});
