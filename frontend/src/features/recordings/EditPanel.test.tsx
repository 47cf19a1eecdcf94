import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { api, ProblemError, type Recording } from "../../lib/api/client";
import { describeOrigin } from "./describeOrigin";
import { EditPanel } from "./EditPanel";

const RECORDING: Recording = {
  id: "a",
  patient_id: "p",
  teaching_id: "t",
  take: 1,
  parent_id: null,
  done: [],
  done_keys: [],
  name: "Lift",
  side: "right",
  station: "Station 1",
  taught_by: "",
  fixtures: [],
  taught_at: "2026-11-21T09:30:00Z",
  duration_s: 8.04,
  rate_hz: 100,
  samples: 805,
  simulated: false,
  note: "",
  updated_at: "2026-11-21T09:30:00Z",
  archived_at: null,
};
const MADE = {
  ...RECORDING,
  id: "b",
  parent_id: "a",
  teaching_id: null,
  take: null,
  readable: true,
  ranges: [],
  margin: null,
};

const preview = vi.spyOn(api, "previewDerived");
const derive = vi.spyOn(api, "derive");
const motion = vi.spyOn(api, "recordingMotion");
const recordings = vi.spyOn(api, "recordings");
const onSaved = vi.fn();

beforeEach(() => {
  vi.resetAllMocks();
  preview.mockResolvedValue({ data: [], layout: {}, texts: [] });
  derive.mockResolvedValue(MADE);
  motion.mockResolvedValue({
    side: "right",
    times_s: [0, 4, 8],
    angles_deg: [0, 60, 0].map((deg) => [0, 0, deg, 0, 0]),
  });
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <EditPanel recording={RECORDING} onSaved={onSaved} />
      </QueryClientProvider>
    </MantineProvider>,
  );
});
afterEach(cleanup);

const press = (name: string) => fireEvent.click(screen.getByRole("button", { name }));
const choose = (label: string) => {
  fireEvent.click(screen.getByRole("combobox", { name: "Type of edit" }));
  fireEvent.click(screen.getByRole("option", { name: label }));
};
const saveButton = () => screen.queryByRole("button", { name: "Save as a new recording" });

describe("an edited recording", () => {
  it("is previewed, then saved as previewed", async () => {
    press("From: increase");
    press("To: decrease");
    expect(saveButton()).toBeNull();
    press("Preview");
    await screen.findByRole("figure");
    const edit = { do: "trim", start_s: 0.5, end_s: 7.5 };
    expect(preview.mock.calls).toEqual([["a", edit]]);

    fireEvent.change(screen.getByRole("textbox", { name: "Name of the new recording" }), {
      target: { value: " Short lift " },
    });
    press("Save as a new recording");
    await waitFor(() => expect(onSaved.mock.calls[0]?.[0]).toEqual(MADE));
    expect(derive.mock.calls).toEqual([["a", { ...edit, name: "Short lift" }]]);
  });

  it("needs a new preview after a change", async () => {
    press("Preview");
    await screen.findByRole("figure");
    expect(saveButton()).not.toBeNull();
    press("From: increase");
    expect(saveButton()).toBeNull();
    expect(screen.queryByRole("figure")).toBeNull();
  });

  it("shows a refusal and saves nothing", async () => {
    preview.mockRejectedValue(
      new ProblemError({ detail: "motor 3 would go to 128.0° at 4.0 s.", next_step: "Choose less." }),
    );
    choose("Stretch at the end of the range");
    press("Beyond the end of the range: increase");
    press("Preview");
    expect((await screen.findByRole("alert")).textContent).toContain(
      "motor 3 would go to 128.0° at 4.0\u00a0s.",
    );
    expect(preview.mock.calls[0]?.[1]).toEqual({ do: "stretch", further_deg: 4, back_deg: 5, hold_s: 10 });
    expect(saveButton()).toBeNull();
  });

  it("needs at least one motor", async () => {
    choose("Some motors only");
    for (const motor of [1, 2, 5]) press(`Motor\u00a0${motor}`);
    press("Preview");
    await waitFor(() => expect(preview.mock.calls[0]?.[1]).toEqual({ do: "isolate", motors: [3, 4] }));
    for (const motor of [3, 4]) press(`Motor\u00a0${motor}`);
    expect(screen.getByRole("button", { name: "Preview" }).hasAttribute("disabled")).toBe(true);
    press("Motor\u00a05");
    expect(screen.getByRole("button", { name: "Motor\u00a05" }).getAttribute("aria-pressed")).toBe("true");
  });

  it.each([
    ["Hold", { do: "hold", at_s: 4, hold_s: 5 }],
    ["Reduce range", { do: "scale", percent: 80, motors: [1, 2, 3, 4, 5] }],
    ["Warm-up", { do: "warm_up", less_deg: 15, step_deg: 3, pause_s: 0 }],
    ["For the other shoulder", { do: "mirror" }],
  ])("%s starts with useful numbers", async (label, edit) => {
    choose(label);
    press("Preview");
    await waitFor(() => expect(preview.mock.calls[0]?.[1]).toEqual(edit));
  });

  it("leaves half a second between the ends", () => {
    const to = screen.getByRole("textbox", { name: "To" });
    fireEvent.change(to, { target: { value: "0.5 s" } });
    expect(screen.getByRole("button", { name: "From: increase" }).hasAttribute("disabled")).toBe(true);
    expect(screen.getByRole("button", { name: "To: decrease" }).hasAttribute("disabled")).toBe(true);
  });
});

describe("a retouch", () => {
  const previewed = async () => {
    press("Preview");
    await waitFor(() => expect(preview.mock.calls).toHaveLength(1));
    return preview.mock.calls[0]?.[1];
  };
  const part = { do: "retouch", start_s: 2, end_s: 6 };

  it("moves its point by arrow keys and by numbers", async () => {
    choose("Change a part of the curve");
    expect(screen.getByRole("button", { name: "Preview" }).hasAttribute("disabled")).toBe(true);
    press("Add a point");
    const point = await screen.findByRole("slider", { name: "Point 1" });
    fireEvent.keyDown(point, { key: "ArrowDown", shiftKey: true });
    fireEvent.keyDown(point, { key: "ArrowRight" });
    expect(point.getAttribute("aria-valuetext")).toBe("4.1\u00a0s, change −5.0°");
    press("Change: decrease");
    fireEvent.keyDown(screen.getByRole("slider", { name: "To" }), { key: "ArrowLeft" });
    const points = [{ motor: 3, at_s: 4.1, change_deg: -5.5 }];
    expect(await previewed()).toEqual({ ...part, end_s: 5.9, points });
  });

  it("moves its point by pointer, as one step to undo", async () => {
    choose("Change a part of the curve");
    press("Add a point");
    const point = await screen.findByRole("slider", { name: "Point 1" });
    Object.assign(point, { setPointerCapture: () => {} });
    fireEvent.pointerDown(point, { pointerId: 1, clientX: 100, clientY: 100 });
    for (const clientY of [120, 160, 200])
      fireEvent.pointerMove(point, { pointerId: 1, clientX: 100, clientY });
    fireEvent.pointerUp(point, { pointerId: 1 });
    expect(Number(point.getAttribute("aria-valuenow"))).toBeLessThan(-20);
    press("Undo");
    expect(point.getAttribute("aria-valuenow")).toBe("0");
    fireEvent.keyDown(point, { key: "z", ctrlKey: true });
    expect(screen.queryByRole("slider", { name: "Point 1" })).toBeNull();
    expect(screen.getByRole("button", { name: "Undo" }).hasAttribute("disabled")).toBe(true);
  });

  it("has points of several motors and none after deletion", async () => {
    choose("Change a part of the curve");
    press("Add a point");
    press("Change: increase");
    press("Motor\u00a04");
    press("Add a point");
    await screen.findByRole("slider", { name: "Point 1" });
    press("Delete the point");
    expect(screen.queryByRole("slider", { name: "Point 1" })).toBeNull();
    expect(await previewed()).toEqual({ ...part, points: [{ motor: 3, at_s: 4, change_deg: 0.5 }] });
  });
});

it("guides the scapula by the unaffected side", async () => {
  choose("Guide the scapula by the unaffected side");
  press("Preview");
  await waitFor(() => expect(preview.mock.calls[0]?.[1]).toEqual({ do: "guide" }));
});

describe("a part that was taught again", () => {
  const part = { ...RECORDING, id: "n", name: "New part", duration_s: 4 };

  it("is chosen from the other recordings of this shoulder", async () => {
    recordings.mockResolvedValue({
      items: [
        RECORDING,
        part,
        { ...part, id: "x", name: "Other shoulder", side: "left" },
        { ...part, id: "y", name: "Archived", archived_at: "2026-11-22T09:30:00Z" },
      ],
    });
    choose("Replace a part by a new teaching");
    fireEvent.click(await screen.findByRole("combobox", { name: "Recording of the new part" }));
    const options = (await screen.findAllByRole("option")).map(({ textContent }) => textContent);
    expect(options.filter((text) => /New part|Other shoulder|Archived|Lift/.test(text ?? ""))).toHaveLength(
      1,
    );
    expect(screen.getByRole("button", { name: "Preview" }).hasAttribute("disabled")).toBe(true);
    fireEvent.click(screen.getByRole("option", { name: /New part/ }));
    press("Preview");
    await waitFor(() =>
      expect(preview.mock.calls[0]?.[1]).toEqual({
        do: "reteach",
        start_s: 2,
        end_s: 6,
        recording_id: "n",
      }),
    );
  });

  it("must be taught first", async () => {
    recordings.mockResolvedValue({ items: [RECORDING] });
    choose("Replace a part by a new teaching");
    expect(await screen.findByText(/Teach the part first/)).toBeTruthy();
  });
});

describe("the origin of a recording", () => {
  it("is described for edited recordings", () => {
    const made = { ...MADE, done: ["held for 3 s at 2.0 s", "mirrored for the left shoulder"] };
    expect(describeOrigin(made, [made, RECORDING])).toBe("Created from Lift: mirrored for the left shoulder");
    expect(describeOrigin(made, [made])).toBe(
      "Created from another recording: mirrored for the left shoulder",
    );
    expect(describeOrigin(RECORDING, [RECORDING])).toBeNull();
  });
});
