import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import { api, type Patient, ProblemError } from "../../lib/api/client";
import { AssessmentsSection } from "./AssessmentsSection";
import { describeSpadi } from "./describeFindings";
import { ASSESSMENT, BASELINE, FORM } from "./examples";

const assessments = vi.spyOn(api, "assessments");
const progress = vi.spyOn(api, "progress");
const withdraw = vi.spyOn(api, "withdrawAssessment");
const WITHDRAWN = { ...ASSESSMENT, id: "w", withdrawn_at: "2026-03-10T09:30:00Z" };

beforeEach(() => {
  vi.resetAllMocks();
  vi.spyOn(api, "patient").mockResolvedValue({ id: "p", episode_id: "e", affected_side: "left" } as Patient);
  vi.spyOn(api, "assessmentForm").mockResolvedValue(FORM);
  withdraw.mockResolvedValue(WITHDRAWN);
  progress.mockResolvedValue({ table: { rows: [] }, notes: {}, figure: { data: [] } } as never);
  assessments.mockResolvedValue({ items: [WITHDRAWN, ASSESSMENT, BASELINE], next: null, baseline: BASELINE });
});
afterEach(cleanup);

function show() {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient({ defaultOptions: { queries: { retry: false } } })}>
        <TestRouter>
          <AssessmentsSection patientId="p" />
        </TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
}

const press = async (name: string | RegExp) => fireEvent.click(await screen.findByRole("button", { name }));

it("shows one chart beside the findings, at first that of the range of motion", async () => {
  show();
  const charts = () => progress.mock.calls.map(([episode, chart]) => [episode, chart]);
  await waitFor(() => expect(charts()).toEqual([["e", "rom"]]));
  fireEvent.click(screen.getByRole("radio", { name: "SPADI" }));
  await waitFor(() =>
    expect(charts()).toEqual([
      ["e", "rom"],
      ["e", "spadi"],
    ]),
  );
});

describe("the newest findings", () => {
  it("are described with the change since the first assessment", async () => {
    show();
    const cells = (row: HTMLElement) => [...row.children].map((cell) => cell.textContent);
    expect((await screen.findAllByRole("row")).map(cells)).toEqual([
      ["Motion", "Left, active", "Left, passive", "Right, active"],
      ["Flexion", "105° (+15°)", "120°", "175°"],
      ["External rotation, arm at the side", "−5° (unchanged)", "–", "–"],
    ]);
    const scores = screen.getAllByRole("listitem").map((item) => item.textContent);
    expect(scores).toEqual([
      "Pain (0\u00a0to\u00a010): at rest 2 (−2), average over the last week 5 (unchanged)",
      "SPADI 45\u00a0of\u00a0100 (−10): pain 60, disability 30. Improvement of at least the MCID (8\u00a0to\u00a013 points), but 17 points or less may be measurement error",
    ]);
    expect(screen.getByTestId("newest-assessment").textContent).toMatch(/^Left shoulder, /);
  });

  it("show no change for the first assessment", async () => {
    assessments.mockResolvedValue({ items: [BASELINE], next: null, baseline: BASELINE });
    show();
    expect((await screen.findAllByRole("row"))[1]?.textContent).toBe("Flexion90°");
  });

  it("are absent where nothing was assessed", async () => {
    assessments.mockResolvedValue({ items: [], next: null, baseline: null });
    show();
    await screen.findByText("No assessments yet.");
    expect(screen.queryByTestId("newest-assessment")).toBeNull();
  });

  it.each([
    [-7.9, "Change below the MCID"],
    [-8, "Improvement of at least the MCID"],
    [
      -17,
      "Improvement of at least the MCID (8\u00a0to\u00a013 points), but 17 points or less may be measurement error",
    ],
    [-17.1, "Improvement beyond measurement error (SDC, 17 points)"],
    [8, "Worsening of at least the MCID"],
    [17.1, "Worsening beyond measurement error (SDC, 17 points)"],
  ])("a SPADI change of %d reads: %s", (change, verdict) => {
    const score = { pain: 50, disability: 50, total: 50 + change };
    const words = describeSpadi({ ...ASSESSMENT, spadi_score: score }, withTotal(50), FORM);
    expect(words).toContain(`. ${verdict}`);
  });

  it.each([
    [43.3, 60.5, "SPADI 43.3\u00a0of\u00a0100 (−17.2)", "Improvement beyond measurement error"],
    [43.375, 50.875, "SPADI 43.4\u00a0of\u00a0100 (−7.5)", "Change below the MCID"],
    [43, 60, "SPADI 43\u00a0of\u00a0100 (−17)", "Improvement of at least the MCID"],
  ])("a SPADI of %d after %d is shown so that its verdict fits", (total, first, shown, verdict) => {
    const words = describeSpadi(
      { ...ASSESSMENT, spadi_score: { pain: 50, disability: 50, total } },
      withTotal(first),
      FORM,
    );
    expect(words).toContain(shown);
    expect(words).toContain(`. ${verdict}`);
  });
});

describe("an assessment entered by mistake", () => {
  it("is withdrawn after confirmation and stays listed", async () => {
    show();
    await press("All assessments");
    expect(screen.getAllByText("Withdrawn (entered by mistake)")).toHaveLength(1);
    const first = screen.getAllByRole("button", { name: "Withdraw" })[0];
    if (first) fireEvent.click(first);
    expect(withdraw).not.toHaveBeenCalled();
    await press("Withdraw (entered by mistake)");
    await waitFor(() => expect(withdraw.mock.calls).toEqual([["a", ASSESSMENT.updated_at]]));
  });

  it("is kept if it was changed meanwhile", async () => {
    withdraw.mockRejectedValue(new ProblemError({ detail: "Somebody else has changed this assessment." }));
    show();
    await press("All assessments");
    const first = screen.getAllByRole("button", { name: "Withdraw" })[0];
    if (first) fireEvent.click(first);
    await press("Withdraw (entered by mistake)");
    expect((await screen.findByRole("alert")).textContent).toContain("Somebody else");
  });
});

describe("the form", () => {
  it("opens for a new and for an existing assessment", async () => {
    show();
    await screen.findByTestId("newest-assessment");
    await press("New assessment");
    await screen.findByRole("region", { name: "New assessment" });
    await press("Discard");
    await press("All assessments");
    const change = screen.getAllByRole("button", { name: "Change" })[0];
    if (change) fireEvent.click(change);
    await screen.findByRole("region", { name: "Change assessment" });
  });
});

function withTotal(total: number) {
  return { ...BASELINE, spadi_score: { pain: total, disability: total, total } };
}
