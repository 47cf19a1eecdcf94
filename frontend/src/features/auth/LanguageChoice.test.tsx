import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, expect, it, vi } from "vitest";
import { api } from "../../lib/api/client";
import { speak } from "../../lib/language";
import { store } from "../../lib/live/store";
import { ME } from "./examples";
import { LanguageChoice } from "./LanguageChoice";

vi.mock("../../lib/language", async (original) => ({ ...(await original<object>()), speak: vi.fn() }));

const shown = (own: boolean) =>
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
  vi.mocked(speak).mockReset();
});

it("of one's own is told to the service, then spoken", async () => {
  const told = vi.spyOn(api, "chooseLanguage").mockResolvedValue({ ...ME, language: "ja" });
  shown(true);
  await userEvent.click(screen.getByRole("radio", { name: "日本語" }));
  expect(told.mock.calls[0]?.[0]).toBe("ja");
  expect(speak).toHaveBeenCalledWith("ja");
});

it("of one's own that the service does not take is not spoken", async () => {
  vi.spyOn(api, "chooseLanguage").mockRejectedValue(new Error("no"));
  shown(true);
  await userEvent.click(screen.getByRole("radio", { name: "日本語" }));
  expect(speak).not.toHaveBeenCalled();
  expect(await screen.findByRole("alert")).toBeTruthy();
});

it("before a sign-in is this browser's alone", async () => {
  const told = vi.spyOn(api, "chooseLanguage");
  shown(false);
  await userEvent.click(screen.getByRole("radio", { name: "日本語" }));
  expect(speak).toHaveBeenCalledWith("ja");
  expect(told).not.toHaveBeenCalled();
});

it("does not load the page anew while the motors move or hold an arm", () => {
  vi.spyOn(store, "get").mockReturnValue({ ...store.get(), live: { mode: "paused" } as never });
  shown(true);
  expect(screen.getByRole("radio", { name: "日本語" })).toHaveProperty("disabled", true);
  expect(screen.getByText(/once the apparatus stands/)).toBeTruthy();
});
