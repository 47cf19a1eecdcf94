import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act, cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { ProblemError } from "../lib/api/client";
import { UndoBar } from "./UndoBar";
import { undoStore } from "./undo";

const undo = vi.fn();
const show = () =>
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <UndoBar />
      </QueryClientProvider>
    </MantineProvider>,
  );

beforeEach(() => {
  // The braces avoid a return value, because vitest calls a returned function after the test.
  undo.mockReset();
});
afterEach(() => {
  cleanup();
  vi.useRealTimers();
});

it("takes the action back and goes", async () => {
  undo.mockResolvedValue(undefined);
  show();
  act(() => undoStore.offer({ words: "Yamada Hanako archived.", undo }));
  expect(screen.getByRole("status").textContent).toContain("Yamada Hanako archived.");
  fireEvent.click(screen.getByRole("button", { name: "Undo" }));
  await vi.waitFor(() => expect(screen.queryByRole("button", { name: "Undo" })).toBeNull());
  expect(undo).toHaveBeenCalledOnce();
});

it("stays with the reason when it cannot be taken back", async () => {
  undo.mockRejectedValue(new ProblemError({ detail: "The record has changed.", next_step: "Reload." }));
  show();
  act(() => undoStore.offer({ words: "Archived.", undo }));
  fireEvent.click(screen.getByRole("button", { name: "Undo" }));
  expect((await screen.findByRole("alert")).textContent).toContain("The record has changed.");
  expect(screen.getByRole("button", { name: "Undo" })).toBeTruthy();
});

it("goes after a while, and when the user leaves", () => {
  vi.useFakeTimers();
  const page = show();
  act(() => undoStore.offer({ words: "Archived.", undo }));
  act(() => vi.advanceTimersByTime(20_000));
  expect(screen.queryByText("Archived.")).toBeNull();
  act(() => undoStore.offer({ words: "Archived.", undo }));
  page.unmount();
  expect(undoStore.get()).toBeNull();
});
