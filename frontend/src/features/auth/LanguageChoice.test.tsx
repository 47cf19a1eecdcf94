import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, expect, it, vi } from "vitest";
import { api } from "../../lib/api/client";
import { switchLanguage } from "../../lib/language";
import { store } from "../../lib/live/store";
import { LanguageChoice } from "./LanguageChoice";
import { ME } from "./testUsers";

vi.mock("../../lib/language", async (original) => ({
  ...(await original<object>()),
  switchLanguage: vi.fn(),
}));

const show = (own: boolean) =>
  render(
    <QueryClientProvider client={new QueryClient()}>
      <MantineProvider>
        <LanguageChoice own={own} />
      </MantineProvider>
    </QueryClientProvider>,
  );

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
  vi.mocked(switchLanguage).mockReset();
});

it("saves a user's language, then applies it", async () => {
  const chooseLanguage = vi.spyOn(api, "chooseLanguage").mockResolvedValue({ ...ME, language: "ja" });
  show(true);
  await userEvent.click(screen.getByRole("radio", { name: "日本語" }));
  expect(chooseLanguage.mock.calls[0]?.[0]).toBe("ja");
  expect(switchLanguage).toHaveBeenCalledWith("ja");
});

it("does not apply a language that the service refuses", async () => {
  vi.spyOn(api, "chooseLanguage").mockRejectedValue(new Error("no"));
  show(true);
  await userEvent.click(screen.getByRole("radio", { name: "日本語" }));
  expect(switchLanguage).not.toHaveBeenCalled();
  expect(await screen.findByRole("alert")).toBeTruthy();
});

it("stores the language in this browser before sign-in", async () => {
  const chooseLanguage = vi.spyOn(api, "chooseLanguage");
  show(false);
  await userEvent.click(screen.getByRole("radio", { name: "日本語" }));
  expect(switchLanguage).toHaveBeenCalledWith("ja");
  expect(chooseLanguage).not.toHaveBeenCalled();
});

it("does not reload the page while motors are powered", () => {
  vi.spyOn(store, "get").mockReturnValue({ ...store.get(), live: { mode: "paused" } as never });
  show(true);
  expect(screen.getByRole("radio", { name: "日本語" })).toHaveProperty("disabled", true);
  expect(screen.getByText(/when the apparatus has stopped/)).toBeTruthy();
});
