import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor, within } from "@testing-library/react";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { api, type Session } from "../../lib/api/client";
import { undoStore } from "../../ui/undo";
import * as auth from "../auth/hooks";
import { GoniometerCard } from "./GoniometerCard";

const reading = {
  id: "r",
  motion: 4,
  apparatus_deg: 80,
  patient_deg: 78,
  read_at: "2026-11-02T09:00:00Z",
  read_by: "Sato Ken",
};
const session = (given: Partial<Session>) =>
  ({
    id: "s",
    patient: { id: "p" },
    started_at: "2026-11-02T08:50:00Z",
    ended_at: null,
    signed_at: null,
    goniometer_readings: [],
    ...given,
  }) as unknown as Session;

beforeEach(() => vi.spyOn(auth, "useHasPermission").mockReturnValue(true));
afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

function show(given: Partial<Session> = {}) {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <GoniometerCard session={session(given)} />
      </QueryClientProvider>
    </MantineProvider>,
  );
}

const field = (name: string) => screen.getByRole("textbox", { name });

it("says that only the apparatus angle is known without a reading", () => {
  show();
  expect(screen.getByText(/only apparatus angles are known/)).toBeTruthy();
});

it("sends what was read, with the apparatus angle that is measured now", async () => {
  const add = vi.spyOn(api, "addGoniometerReading").mockResolvedValue(session({}));
  show();
  fireEvent.change(field("Goniometer, °"), { target: { value: "82" } });
  fireEvent.click(screen.getByRole("button", { name: "Add the reading" }));
  await waitFor(() => expect(add).toHaveBeenCalled());
  expect(add.mock.calls[0]).toEqual(["s", { motion: 4, patient_deg: 82, apparatus_deg: null, read_by: "" }]);
});

it("wants the apparatus angle after the session's end", () => {
  show({ ended_at: "2026-11-02T09:30:00Z" });
  const add = () => screen.getByRole<HTMLButtonElement>("button", { name: "Add the reading" });
  fireEvent.change(field("Goniometer, °"), { target: { value: "82" } });
  expect(add().disabled).toBe(true);
  fireEvent.change(field("Apparatus angle, °"), { target: { value: "90" } });
  expect(add().disabled).toBe(false);
});

it("removes a reading, and neither adds nor removes in a signed session", async () => {
  const remove = vi.spyOn(api, "removeGoniometerReading").mockResolvedValue(session({}));
  show({ goniometer_readings: [reading] });
  const table = screen.getByTestId("goniometer-readings");
  expect(within(table).getByText("78.0")).toBeTruthy();
  fireEvent.click(within(table).getByRole("button"));
  await waitFor(() => expect(remove).toHaveBeenCalledWith("s", "r"));
  cleanup();
  show({ goniometer_readings: [reading], signed_at: "2026-11-02T10:00:00Z" });
  expect(screen.queryByRole("button")).toBeNull();
});

it("offers to undo the removal of a reading", async () => {
  vi.spyOn(api, "removeGoniometerReading").mockResolvedValue(session({}));
  const add = vi.spyOn(api, "addGoniometerReading").mockResolvedValue(session({}));
  show({ goniometer_readings: [reading], ended_at: "2026-11-02T09:30:00Z" });
  fireEvent.click(within(screen.getByTestId("goniometer-readings")).getByRole("button"));
  await waitFor(() => expect(undoStore.get()?.words).toMatch(/, 78\.0°, was removed\.$/));
  await undoStore.get()?.undo();
  expect(add.mock.calls).toEqual([
    ["s", { motion: 4, patient_deg: 78, apparatus_deg: 80, read_by: "Sato Ken" }],
  ]);
  undoStore.clear();
});
