import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { ApparatusView } from "./ApparatusView";
import type { Scheme } from "./colours";
import type { Picture, WorkerSetup } from "./scene/picture";

let pictures: Picture[] = [];
class FakeWorker {
  postMessage(message: WorkerSetup | Picture) {
    if ("number" in message) pictures.push(message);
  }
  terminate() {}
}

const view = (scheme: Scheme) => (
  <MantineProvider env="test" forceColorScheme={scheme}>
    <ApparatusView side="right" limits={[]} real={null} ghost={null} label="Apparatus" />
  </MantineProvider>
);

beforeEach(() => {
  pictures = [];
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
