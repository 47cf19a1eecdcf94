import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { api, type Episode, type Programme, type Recording } from "../../lib/api/client";
import { forgetDrafts } from "../../lib/draft";
import { NewProgramme } from "./NewProgrammePage";

const LEFT = { id: "left", side: "left", diagnosis: "Frozen shoulder", closed_at: null } as Episode;
const RIGHT = { id: "right", side: "right", diagnosis: "", closed_at: null } as Episode;
const lift = (side: "left" | "right") =>
  ({ id: `lift-${side}`, name: `Lift ${side}`, side, duration_s: 30, archived_at: null }) as Recording;

const create = vi.spyOn(api, "createProgramme");
const onSaved = vi.fn();

beforeEach(() => {
  vi.resetAllMocks();
  create.mockResolvedValue({ id: "made" } as Programme);
  vi.spyOn(api, "recordings").mockResolvedValue({ items: [lift("left"), lift("right")] });
  vi.spyOn(api, "previewProgramme").mockResolvedValue({
    duration_s: 30,
    items: [{ duration_s: 30, problem: null }],
  });
});
afterEach(() => {
  cleanup();
  forgetDrafts();
});

function show(items: Episode[]) {
  vi.spyOn(api, "episodes").mockResolvedValue({ items, next: null });
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <NewProgramme patientId="p" onSaved={onSaved} onCancel={vi.fn()} />
      </QueryClientProvider>
    </MantineProvider>,
  );
}

const add = async (name: string, chooses = true) => {
  fireEvent.click(await screen.findByRole("combobox", { name: "Add a recording" }));
  fireEvent.click(await screen.findByText(name));
  if (chooses) fireEvent.click(screen.getByRole("button", { name: "One level higher" }));
  fireEvent.click(screen.getByText("Done"));
};

it("uses the only open episode without asking", async () => {
  show([LEFT, { ...RIGHT, closed_at: "2026-11-01T09:00:00Z" } as Episode]);
  expect(await screen.findByLabelText(/Name of the programme/)).toBeTruthy();
  expect(screen.queryByRole("radiogroup")).toBeNull();
});

it("asks for the episode and offers its shoulder's recordings", async () => {
  show([LEFT, RIGHT]);
  await screen.findByLabelText("Left shoulder: Frozen shoulder");
  expect(screen.queryByLabelText(/Name of the programme/)).toBeNull();
  fireEvent.click(screen.getByLabelText("Right shoulder: no diagnosis noted"));
  fireEvent.change(await screen.findByLabelText(/Name of the programme/), { target: { value: "Morning" } });
  await add("Lift right · 30 s");
  expect(screen.queryByText("Lift left · 30 s")).toBeNull();
  fireEvent.click(screen.getByText("Save the programme"));
  await waitFor(() => expect(onSaved).toHaveBeenCalled());
  expect(create.mock.calls[0]?.[1]).toMatchObject({
    name: "Morning",
    episode_id: "right",
    items: [{ recording_id: "lift-right" }],
  });
});

it("is impossible without an open episode", async () => {
  show([]);
  expect(await screen.findByText(/No episode of care is open/)).toBeTruthy();
});

it("is saved only after choosing a resistance level", async () => {
  show([{ ...LEFT, max_resistance_level: 12 } as Episode]);
  fireEvent.change(await screen.findByLabelText(/Name of the programme/), { target: { value: "Morning" } });
  await add("Lift left · 30 s", false);
  const save = screen.getByText("Save the programme").closest("button") as HTMLButtonElement;
  expect(save.disabled).toBe(true);
  expect(screen.getByText("Resistance level not chosen yet: Lift left")).toBeTruthy();
  fireEvent.click(screen.getByRole("button", { name: "Lift left: settings" }));
  fireEvent.click(screen.getByRole("button", { name: "One level higher" }));
  fireEvent.click(screen.getByText("Done"));
  expect(screen.queryByText(/Resistance level not chosen/)).toBeNull();
  fireEvent.click(save);
  await waitFor(() => expect(onSaved).toHaveBeenCalled());
});
