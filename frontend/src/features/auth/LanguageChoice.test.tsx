import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { api } from "../../lib/api/client";
import { store } from "../../lib/live/store";
import { LanguageChoice } from "./LanguageChoice";
import { ME } from "./testUsers";

const reload = vi.fn();

const show = (own: boolean) =>
  render(
    <QueryClientProvider client={new QueryClient()}>
      <MantineProvider>
        <LanguageChoice own={own} />
      </MantineProvider>
    </QueryClientProvider>,
  );

const stored = () => localStorage.getItem("kata.language");

beforeEach(() => vi.stubGlobal("location", { reload }));
afterEach(() => {
  cleanup();
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
  reload.mockReset();
  localStorage.clear();
});

it("saves a user's language, then applies it", async () => {
  const chooseLanguage = vi.spyOn(api, "chooseLanguage").mockResolvedValue({ ...ME, language: "ja" });
  show(true);
  await userEvent.click(screen.getByRole("radio", { name: "日本語" }));
  expect(chooseLanguage.mock.calls[0]?.[0]).toBe("ja");
  expect([stored(), reload.mock.calls.length]).toEqual(["ja", 1]);
});

it("does not apply a language that the service refuses", async () => {
  vi.spyOn(api, "chooseLanguage").mockRejectedValue(new Error("no"));
  show(true);
  await userEvent.click(screen.getByRole("radio", { name: "日本語" }));
  expect([stored(), reload.mock.calls.length]).toEqual([null, 0]);
  expect(await screen.findByRole("alert")).toBeTruthy();
});

it("stores the language in this browser before sign-in", async () => {
  const chooseLanguage = vi.spyOn(api, "chooseLanguage");
  show(false);
  await userEvent.click(screen.getByRole("radio", { name: "日本語" }));
  expect([stored(), reload.mock.calls.length]).toEqual(["ja", 1]);
  expect(chooseLanguage).not.toHaveBeenCalled();
});

it.each([
  { mode: "paused", stop: null },
  { mode: "stopped", stop: { arm_held: true } },
])("does not reload the page while motors may hold the arm: $mode", (live) => {
  vi.spyOn(store, "get").mockReturnValue({ ...store.get(), live: live as never });
  show(true);
  expect(screen.getByRole("radio", { name: "日本語" })).toHaveProperty("disabled", true);
  expect(screen.getByText(/when the apparatus has stopped/)).toBeTruthy();
});
