import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { lazy } from "react";
import { afterEach, expect, it, vi } from "vitest";
import { LazyPart } from "./LazyPart";

afterEach(cleanup);

const Missing = lazy(() => Promise.reject(new Error("the service is gone")));

it("leaves the rest of the page when a module does not load", async () => {
  vi.spyOn(console, "error").mockImplementation(() => undefined);
  render(
    <MantineProvider>
      <button type="button">Stop</button>
      <LazyPart loading="loading">
        <Missing />
      </LazyPart>
    </MantineProvider>,
  );
  expect(await screen.findByText("This part could not be loaded. Reload the page.")).toBeTruthy();
  expect(screen.getByRole("button", { name: "Stop" })).toBeTruthy();
});
