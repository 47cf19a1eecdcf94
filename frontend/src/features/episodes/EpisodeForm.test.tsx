import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { api, type Episode, ProblemError } from "../../lib/api/client";
import { forgetDrafts } from "../../lib/draft";
import { EpisodeForm } from "./EpisodeForm";
import { EpisodeCard } from "./Episodes";
import { describeLimit } from "./messages";

const EPISODE: Episode = {
  id: "e",
  patient_id: "p",
  side: "right",
  diagnosis: "Adhesive capsulitis",
  diagnosis_code: "",
  verification: "",
  onset_on: "2026-05-01",
  contraindications: "No traction.",
  limits: [{ motion: 4, lowest_deg: null, highest_deg: 90 }],
  max_resistance_level: 12,
  max_speed_deg_s: 40,
  self_paced_permitted: false,
  limits_by: "Dr. Mori",
  opened_at: "2026-06-01T09:30:00Z",
  closed_at: null,
  closing_note: "",
  updated_at: "2026-06-01T09:30:00Z",
  stage: null,
  stages: [],
};

const update = vi.spyOn(api, "updateEpisode");
const open = vi.spyOn(api, "openEpisode");
const add = vi.spyOn(api, "addStage");
const close = vi.spyOn(api, "closeEpisode");
const onDone = vi.fn();

const show = (shown: React.ReactNode) =>
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>{shown}</QueryClientProvider>
    </MantineProvider>,
  );
const type = (label: string, value: string) =>
  fireEvent.change(screen.getByLabelText(label), { target: { value } });
const choose = (label: string, option: string) => {
  fireEvent.click(screen.getByLabelText(label, { selector: "input" }));
  fireEvent.click(screen.getByRole("option", { name: option, hidden: true }));
};
const press = (name: string) => fireEvent.click(screen.getByRole("button", { name }));

beforeEach(() => {
  vi.resetAllMocks();
  for (const call of [update, open, add, close]) call.mockResolvedValue(EPISODE);
});
afterEach(cleanup);

describe("changing an episode", () => {
  const edit = (episode = EPISODE) => (
    <EpisodeForm patientId="p" side="right" episode={episode} onDone={onDone} />
  );

  it("sends all fields with the version that was read", async () => {
    show(edit());
    type("Flexion / extension of the shoulder: minimum", "-10");
    type("Diagnosis", "Fracture");
    choose("Coded diagnosis (ICD-10)", "Fracture of the upper end of the humerus (S42.2)");
    choose("Certainty of the diagnosis", "Provisional");
    type("Maximum speed", "25°/s");
    fireEvent.click(screen.getByLabelText("The patient may set the pace of a playback"));
    press("Save");
    await waitFor(() => expect(onDone).toHaveBeenCalled());
    expect(update.mock.calls).toEqual([
      [
        "e",
        {
          diagnosis: "Fracture",
          diagnosis_code: "S42.2",
          verification: "provisional",
          onset_on: "2026-05-01",
          contraindications: "No traction.",
          limits: [
            { motion: 4, lowest_deg: null, highest_deg: 90 },
            { motion: 5, lowest_deg: -10, highest_deg: null },
          ],
          max_resistance_level: 12,
          max_speed_deg_s: 25,
          self_paced_permitted: true,
          limits_by: "Dr. Mori",
          updated_at: EPISODE.updated_at,
        },
      ],
    ]);
  });

  it("does not adopt a newer version during editing", async () => {
    const shown = show(edit());
    type("Diagnosis", "Fracture");
    const newer = { ...EPISODE, diagnosis: "Other", updated_at: "2026-06-02T09:30:00Z" };
    shown.rerender(
      <MantineProvider env="test">
        <QueryClientProvider client={new QueryClient()}>{edit(newer)}</QueryClientProvider>
      </MantineProvider>,
    );
    press("Save");
    await waitFor(() => expect(update.mock.calls[0]?.[1].updated_at).toBe(EPISODE.updated_at));
  });

  it("shows the error of a limit at its motion", async () => {
    // The service counts the sent limits: motion 5 is the second one.
    const error = (pointer: string, detail: string) => ({
      pointer,
      field: "doctor's limits 2",
      detail,
      field_key: null,
      detail_key: null,
    });
    const errors = [
      error("#/limits/0", "must have a lowest angle below the highest one"),
      error("#/limits/1/highest_deg", "must be 190 or less"),
    ];
    update.mockRejectedValue(
      new ProblemError({ detail: "doctor's limits 2, highest (°) must be …", errors }),
    );
    show(edit());
    type("Flexion / extension of the shoulder: maximum", "500");
    press("Save");
    const described = (label: string) =>
      document.getElementById(screen.getByLabelText(label).getAttribute("aria-describedby") ?? "")
        ?.textContent;
    await screen.findByText("Please check the marked fields.");
    expect(described("Flexion / extension of the shoulder: maximum")).toBe("must be 190 or less");
    expect(described("Abduction / adduction of the shoulder: minimum")).toContain("below the highest one");
    expect(screen.queryByText(/doctor's limits 2/)).toBeNull();
    expect(document.activeElement).toBe(
      screen.getByLabelText("Abduction / adduction of the shoulder: minimum"),
    );
    forgetDrafts();
  });

  it("removes a limit when its number is cleared", async () => {
    show(edit());
    type("Abduction / adduction of the shoulder: maximum", "");
    press("Save");
    await waitFor(() => expect(update.mock.calls[0]?.[1].limits).toEqual([]));
  });

  it("sends no speed limit when its number is cleared", async () => {
    show(edit());
    type("Maximum speed", "");
    press("Save");
    await waitFor(() => expect(update.mock.calls[0]?.[1].max_speed_deg_s).toBeNull());
  });

  it("shows what is wrong with the speed limit beside it", async () => {
    const problem = { detail: "Please check what was entered.", next_step: "" };
    update.mockRejectedValue(
      new ProblemError({
        ...problem,
        errors: [
          {
            pointer: "#/max_speed_deg_s",
            field: "max_speed_deg_s",
            detail: "At most 150.",
            field_key: null,
            detail_key: null,
          },
        ],
      }),
    );
    show(edit());
    type("Maximum speed", "200°/s");
    press("Save");
    expect(await screen.findByText("At most 150.")).toBeTruthy();
    expect(screen.getByLabelText("Maximum speed")).toHaveProperty("value", "200°/s");
  });

  it("shows why saving failed and keeps the input", async () => {
    update.mockRejectedValue(
      new ProblemError({
        detail: "The name of the doctor who set the limits is missing.",
        next_step: "Write the name.",
      }),
    );
    show(edit());
    type("Doctor who set the limits", "");
    press("Save");
    expect((await screen.findByRole("alert")).textContent).toContain("name of the doctor");
    expect(screen.getByLabelText("Diagnosis")).toHaveProperty("value", "Adhesive capsulitis");
    expect(onDone).not.toHaveBeenCalled();
  });
});

it("a new episode is opened for its side", async () => {
  show(<EpisodeForm patientId="p" side="left" onDone={onDone} />);
  press("Open episode");
  await waitFor(() => expect(open.mock.calls[0]?.[0]).toBe("p"));
  expect(open.mock.calls[0]?.[1]).toMatchObject({ side: "left", limits: [], max_resistance_level: null });
});

describe("an episode on the patient's page", () => {
  it("shows the doctor's limits and a missing stage", () => {
    show(<EpisodeCard episode={EPISODE} onSaved={onDone} />);
    expect(screen.getByTestId("limits").textContent).toBe(
      "Limits set by Dr. MoriAbduction / adduction of the shoulder: at most 90°Resistance level: at most 12\u00a0of\u00a025Motor speed: at most 40°/s",
    );
    expect(screen.getByText("No stage recorded")).toBeTruthy();
  });

  it("accepts another stage", async () => {
    show(<EpisodeCard episode={EPISODE} onSaved={onDone} />);
    expect(screen.getByRole("button", { name: "Record stage" })).toHaveProperty("disabled", true);
    fireEvent.click(screen.getByRole("combobox", { name: "New stage" }));
    fireEvent.click(screen.getByRole("option", { name: "Frozen" }));
    type("Since", "2026-08-01");
    press("Record stage");
    await waitFor(() => expect(add.mock.calls).toEqual([["e", { stage: "frozen", since: "2026-08-01" }]]));
    await waitFor(() => expect(onDone).toHaveBeenCalled());
  });

  it("is closed with a note", async () => {
    show(<EpisodeCard episode={EPISODE} onSaved={onDone} />);
    press("Close episode");
    fireEvent.change(await screen.findByLabelText("Closing note"), { target: { value: "Full range." } });
    fireEvent.click(screen.getAllByRole("button", { name: "Close episode" }).at(-1) as HTMLElement);
    await waitFor(() =>
      expect(close.mock.calls).toEqual([
        ["e", { closing_note: "Full range.", updated_at: EPISODE.updated_at }],
      ]),
    );
  });

  it("can only be reopened after closing", () => {
    show(<EpisodeCard episode={{ ...EPISODE, closed_at: "2026-09-01T09:30:00Z" }} onSaved={onDone} />);
    expect(screen.queryByRole("button", { name: "Change" })).toBeNull();
    expect(screen.getByRole("button", { name: "Reopen" })).toBeTruthy();
  });
});

describe("words", () => {
  it.each([
    [
      { motion: 4, lowest_deg: 0, highest_deg: 90 },
      "Abduction / adduction of the shoulder: 0\u00a0to\u00a090°",
    ],
    [{ motion: 1, lowest_deg: -10 }, "Abduction / adduction of the scapula: at least −10°"],
  ])("of a limit", (limit, words) => expect(describeLimit(limit)).toBe(words));
});
