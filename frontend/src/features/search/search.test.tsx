import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { createMemoryHistory } from "@tanstack/react-router";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import { api, type Me, type Patient } from "../../lib/api/client";
import { authStore } from "../auth/authState";
import { SearchButton } from "./SearchButton";
import { findPages } from "./searchResults";

const YAMADA = {
  id: "p1",
  name: "Yamada Hanako",
  kana: "ヤマダ ハナコ",
  clinic_number: "K-0042",
  birth_date: "1968-04-12",
  episode_id: "e1",
} as Patient;
const patients = vi.spyOn(api, "patients");
const sessions = vi.spyOn(api, "sessions");
const ofPatient = vi.spyOn(api, "patientSessions");
const session = { id: "s1", started_at: "2026-11-05T09:30:00Z", patient: YAMADA };

function show(permissions: Me["permissions"]) {
  vi.spyOn(authStore, "get").mockReturnValue({ is: "in", me: { permissions } as Me } as never);
  const history = createMemoryHistory();
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <TestRouter history={history}>
          <SearchButton />
        </TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
  return history;
}

/** Open the search by its shortcut, and type the words. */
async function search(words: string) {
  await screen.findByRole("button", { name: "Search everywhere" });
  fireEvent.keyDown(document.documentElement, { key: "k", code: "KeyK", ctrlKey: true });
  const field = await screen.findByRole("combobox", { name: "Search everywhere" });
  fireEvent.change(field, { target: { value: words } });
  return field;
}

beforeEach(() => {
  vi.resetAllMocks();
  patients.mockResolvedValue({ items: [YAMADA], next: null });
  ofPatient.mockResolvedValue({ items: [session], next: null } as never);
  sessions.mockResolvedValue({ items: [session], next: null } as never);
  vi.spyOn(api, "recordings").mockResolvedValue({ items: [] });
});
afterEach(cleanup);

describe("the search", () => {
  it("opens by keys, finds a patient, and goes there with Enter", async () => {
    const history = show(["read_records", "operate"]);
    const field = await search("やまだ");
    expect(await screen.findByRole("option", { name: /^Yamada Hanako/ })).toBeTruthy();
    expect(patients).toHaveBeenLastCalledWith("やまだ", false);
    expect(screen.getByRole("option", { name: "Go to the station with Yamada Hanako" })).toBeTruthy();
    const best = screen.getByRole("option", { name: /^Yamada Hanako/ });
    await vi.waitFor(() => expect(best.getAttribute("data-combobox-selected")).toBe("true"));
    fireEvent.keyDown(field, { key: "Enter", code: "Enter" });
    await vi.waitFor(() => expect(history.location.pathname).toBe("/patients/p1"));
    await vi.waitFor(() => expect(screen.queryByRole("dialog")).toBeNull());
  });

  it("asks for no record without the permission", async () => {
    show(["see_station"]);
    await search("station");
    expect(await screen.findByRole("option", { name: "Stations" })).toBeTruthy();
    expect(screen.queryByRole("option", { name: "Patients" })).toBeNull();
    for (const asked of [patients, sessions, ofPatient]) expect(asked).not.toHaveBeenCalled();
  });

  it("finds the sessions of a day", async () => {
    patients.mockResolvedValue({ items: [], next: null });
    show(["read_records"]);
    await search("2026/11/5");
    expect(await screen.findByRole("option", { name: /Nov\u00a05,\u00a02026/ })).toBeTruthy();
    expect(sessions).toHaveBeenCalledWith({
      since: new Date("2026-11-05T00:00").toISOString(),
      until: new Date("2026-11-06T00:00").toISOString(),
    });
  });

  it("finds actions that need no patient, within the permissions", async () => {
    patients.mockResolvedValue({ items: [], next: null });
    const history = show(["read_records", "write_records"]);
    await search("new patient");
    fireEvent.click(await screen.findByRole("option", { name: "New patient" }));
    await vi.waitFor(() => expect(history.location.href).toBe("/patients?register=true"));
    cleanup();
    show(["read_records"]);
    await search("");
    expect(await screen.findByRole("option", { name: "Sessions with unsigned notes" })).toBeTruthy();
    expect(screen.queryByRole("option", { name: "New patient" })).toBeNull();
  });

  it("is closed by Esc", async () => {
    show(["read_records"]);
    fireEvent.keyDown(await search("yam"), { key: "Escape", code: "Escape" });
    await vi.waitFor(() => expect(screen.queryByRole("dialog")).toBeNull());
  });

  it("says when nothing is found", async () => {
    patients.mockResolvedValue({ items: [], next: null });
    show(["read_records"]);
    await search("qqq");
    expect(await screen.findByText("Nothing found.")).toBeTruthy();
  });
});

it("the shortcuts are listed by keys", async () => {
  show([]);
  await screen.findByRole("button", { name: "Search everywhere" });
  fireEvent.keyDown(document.documentElement, { key: "/", code: "Slash", ctrlKey: true });
  expect(await screen.findByRole("dialog", { name: "Keyboard shortcuts" })).toBeTruthy();
});

it("pages are found by parts of their names, within the permissions", () => {
  const names = (typed: string, ...permissions: Me["permissions"]) =>
    findPages(typed, permissions).map(({ words }) => words);
  expect(names("AUD", "administer")).toEqual(["Audit trail"]);
  expect(names("aud", "read_records")).toEqual([]);
  expect(names("", "read_records")).toEqual(["Patients", "Sessions"]);
  expect(names("clinic", "see_station")).toEqual(["Clinic"]);
  // The clinic's figures and its settings have the same name.
  const clinics = findPages("clinic", ["see_station", "administer"]).map(({ detail }) => detail);
  expect(clinics).toEqual([undefined, "Administration"]);
  expect(names("station settings", "commission")).toEqual(["Station settings and commissioning"]);
});

it.each(["en", "ja"])("pages have different names where the page is %s", async (language) => {
  vi.resetModules();
  localStorage.setItem("kata.language", language);
  const { findPages } = await import("./searchResults");
  const needs = ["see_station", "read_records", "own_account", "administer", "commission"] as const;
  // What leads to the clinic's figures and to its settings differs by the section.
  const labels = findPages("", needs).filter(
    ({ detail, target }) => !(detail && target.to.endsWith("/clinic")),
  );
  expect(new Set(labels.map(({ words }) => words)).size).toBe(labels.length);
  localStorage.clear();
});
