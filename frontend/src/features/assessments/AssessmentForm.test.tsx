import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor, within } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { type Assessment, api, ProblemError } from "../../lib/api/client";
import { AssessmentForm } from "./AssessmentForm";
import { ASSESSMENT, FORM } from "./examples";
import { spadiScore } from "./spadi";

const create = vi.spyOn(api, "createAssessment");
const update = vi.spyOn(api, "updateAssessment");
const onDone = vi.fn();

beforeEach(() => {
  vi.resetAllMocks();
  create.mockResolvedValue(ASSESSMENT);
  update.mockResolvedValue(ASSESSMENT);
});
afterEach(cleanup);

function show(assessment?: Assessment) {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <AssessmentForm
          episodeId="e"
          affected="left"
          form={FORM}
          last={assessment ? null : ASSESSMENT}
          onDone={onDone}
          {...(assessment && { assessment })}
        />
      </QueryClientProvider>
    </MantineProvider>,
  );
}

// Fields are found by label, because queries by role take seconds among so many fields.
const field = (name: string | RegExp) => screen.getByLabelText(name);
const type = (name: string | RegExp, value: string) => fireEvent.change(field(name), { target: { value } });
const press = (name: string | RegExp) => fireEvent.click(screen.getByText(name));
const open = (name: string) => fireEvent.click(screen.getByRole("tab", { name }));
const pick = (group: string | RegExp, number: number) =>
  fireEvent.click(within(field(group)).getByText(String(number)));

describe("entering an assessment", () => {
  it("sends only the entered values", async () => {
    show();
    type(/Assessed by/, " Kimura Jun ");
    type(/Date and time/, "2026-03-02T09:30");
    type("Flexion, left, active", "110");
    type("Flexion, right, passive", "172,5");
    press(/More motions/);
    type("External rotation, arm flexed 90°, left, passive", "−10");
    open("Pain");
    pick("At rest", 3);
    pick("On active movement", 7);
    pick("On active movement", 7);
    type("Note", "Slept badly.");
    press("Save assessment");
    await waitFor(() => expect(onDone).toHaveBeenCalled());
    const entry = { motion: "flexion", position: "" };
    expect(create.mock.calls).toEqual([
      [
        "e",
        {
          assessed_at: new Date("2026-03-02T09:30").toISOString(),
          assessed_by: "Kimura Jun",
          rom: [
            { ...entry, side: "left", kind: "active", angle_deg: 110 },
            { ...entry, side: "right", kind: "passive", angle_deg: 172.5 },
            {
              side: "left",
              motion: "external_rotation",
              position: "flexed_90",
              kind: "passive",
              angle_deg: -10,
            },
          ],
          pain_rest: 3,
          pain_active: null,
          pain_passive: null,
          pain_average: null,
          spadi: null,
          note: "Slept badly.",
        },
      ],
    ]);
  });

  it("shows the last angles in empty fields", () => {
    show();
    expect(field("Flexion, left, active").getAttribute("placeholder")).toBe("105");
    expect(field("Extension, left, active").getAttribute("placeholder")).toBe("");
  });

  it("moves down with Enter and on to the next column", () => {
    show();
    const focused: (string | null)[] = [];
    field("Flexion, left, active").focus();
    for (let step = 0; step < 3; step++) {
      fireEvent.keyDown(document.activeElement as Element, { key: "Enter" });
      focused.push(document.activeElement?.getAttribute("aria-label") ?? null);
    }
    expect(focused).toEqual([
      "Extension, left, active",
      "External rotation, arm at the side, left, active",
      "Flexion, left, passive",
    ]);
    expect(create).not.toHaveBeenCalled();
  });

  it.each(["201", "12o", "-21"])("rejects %s as a flexion at once", (typed) => {
    show();
    type("Flexion, left, active", typed);
    expect(screen.getByRole("alert").textContent).toBe("Flexion must be between −20° and 200°.");
    expect(screen.getByText("Save assessment").closest("button")?.disabled).toBe(true);
    type("Flexion, left, active", "120");
    expect(screen.queryByRole("alert")).toBeNull();
  });

  it("shows the zero of the third position, and warns of an angle that fits the other zero", () => {
    show();
    expect(screen.queryByAltText(/forearm straight up is 0°/)).toBeNull();
    press(/More motions/);
    expect(screen.getByAltText(/forearm straight up is 0°/)).toBeTruthy();
    const outwards = "External rotation, arm flexed 90°, left, passive";
    const inwards = "Internal rotation, arm flexed 90°, left, passive";
    const notes = () => screen.queryAllByRole("status").map((note) => note.textContent);
    type(outwards, "45");
    expect(notes()).toEqual([]);
    type(outwards, "100");
    expect(notes()).toEqual([
      `${outwards}: 100° looks like an angle from the forearm level across the chest. From the forearm straight up, ` +
        "the same rotation is 10°. Check the zero. The angle is saved as typed.",
    ]);
    expect(screen.getByText("Save assessment").closest("button")?.disabled).toBe(false);
    type(inwards, "−5");
    expect(notes()[1]).toContain(`${inwards}: −5° looks like`);
    expect(notes()[1]).toContain("the same rotation is 85°");
    // The rotation outwards of a stiff shoulder is counted from Kata's zero.
    type(outwards, "10");
    expect(notes()).toEqual([]);
    type(outwards, "");
    expect(notes()).toHaveLength(1);
    type("Internal rotation, arm flexed 90°, right, passive", "80");
    expect(notes()).toHaveLength(1);
  });

  it("keeps the input after a refusal and shows why", async () => {
    create.mockRejectedValue(
      new ProblemError({ detail: "Yamada Hanako is archived.", next_step: "Restore it." }),
    );
    show();
    type("Flexion, left, active", "110");
    press("Save assessment");
    expect((await screen.findByRole("alert")).textContent).toContain(
      "Yamada Hanako is archived. Restore it.",
    );
    expect((field("Flexion, left, active") as HTMLInputElement).value).toBe("110");
    expect(onDone).not.toHaveBeenCalled();
  });
});

describe("changing an assessment", () => {
  it("starts from its values and keeps its time", async () => {
    show(ASSESSMENT);
    expect((field("External rotation, arm at the side, left, active") as HTMLInputElement).value).toBe("-5");
    type("Flexion, left, active", "");
    type("Note", "");
    press("Save assessment");
    await waitFor(() => expect(update).toHaveBeenCalled());
    const [key, body] = update.mock.calls[0] ?? [];
    expect(key).toBe("a");
    expect(body).toMatchObject({ updated_at: ASSESSMENT.updated_at, note: "", pain_rest: 2 });
    expect(body).not.toHaveProperty("assessed_at");
    expect(body?.rom?.map((entry) => entry.angle_deg)).toEqual([120, 175, -5]);
  });
});

describe("the SPADI", () => {
  it("is calculated while it is entered", async () => {
    show(ASSESSMENT);
    open("SPADI");
    const scoreText = () => screen.getByRole("status").textContent;
    expect(scoreText()).toContain("SPADI 45\u00a0of\u00a0100: pain 60, disability 30");
    pick(/^1\. /, 10);
    pick(/^13\. /, 3);
    expect(scoreText()).toContain("SPADI 49\u00a0of\u00a0100: pain 68, disability 30");
    expect(scoreText()).toContain("1\u00a0of\u00a013 items not answered");
    press("Save assessment");
    await waitFor(() => expect(update).toHaveBeenCalled());
    expect(update.mock.calls[0]?.[1].spadi).toEqual([10, 6, 6, 6, 6, 3, 3, 3, 3, 3, 3, 3, null]);
  });
});

describe("the score of the SPADI", () => {
  it.each([
    [Array(13).fill(0), { pain: 0, disability: 0, total: 0 }],
    [Array(13).fill(10), { pain: 100, disability: 100, total: 100 }],
    [[8, 7, 6, 5, 4, ...Array(8).fill(3)], { pain: 60, disability: 30, total: 45 }],
    [[8, null, 6, 6, 4, ...Array(8).fill(3)], { pain: 60, disability: 30, total: 45 }],
    [[null, 6, 6, 6, 6, null, 4, 4, 4, 3, 2, 2, 2], { pain: 60, disability: 30, total: 45 }],
    [[null, null, 6, 6, 6, null, ...Array(7).fill(3)], { pain: null, disability: null, total: null }],
    [[...Array(5).fill(6), null, null, null, 3, 3, 3, 3, 3], { pain: null, disability: null, total: null }],
  ])("of %j equals the service's", (answers, score) => {
    expect(spadiScore(FORM.spadi, answers)).toEqual(score);
  });
});
