import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor, within } from "@testing-library/react";
import type { ReactElement } from "react";
import { afterEach, describe, expect, it, vi } from "vitest";
import { TestRouter } from "../../app/TestRouter";
import { api, ProblemError, type Schemas } from "../../lib/api/client";
import { authStore } from "../auth/authState";
import { ME } from "../auth/testUsers";
import { ErasureRequests } from "./ErasureRequests";
import { ImportMotion } from "./ImportMotion";
import { ImportPatients } from "./ImportPatients";
import { SampleLinks } from "./SampleLinks";
import { ERASURE, PATIENT, UNDERSTOOD } from "./testData";

const show = (element: ReactElement) =>
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient({ defaultOptions: { queries: { retry: false } } })}>
        <TestRouter>{element}</TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
const press = (name: string) => fireEvent.click(screen.getByRole("button", { name }));
const enabled = (name: string) => !(screen.getByRole("button", { name }) as HTMLButtonElement).disabled;
const type = (label: string | RegExp, value: string) =>
  fireEvent.change(screen.getByLabelText(label), { target: { value } });
const give = (name: string) => {
  const input = document.querySelector("input[type=file]") as HTMLInputElement;
  fireEvent.change(input, { target: { files: [new File(["time_s"], name)] } });
};

afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

it("offers measurements of a run as CSV, Parquet, MCAP and LeRobotDataset", () => {
  show(<SampleLinks of="runs" id="r" />);
  const addresses = screen.getAllByRole("link").map((link) => link.getAttribute("href"));
  expect(addresses).toEqual([
    "/api/runs/r/samples.csv",
    "/api/runs/r/samples.parquet",
    "/api/runs/r/samples.mcap",
    "/api/runs/r/samples.lerobot.zip",
  ]);
});

describe("a motion from a CSV file", () => {
  it("is previewed before it is saved", async () => {
    const preview = vi.spyOn(api, "previewMotion").mockResolvedValue(UNDERSTOOD);
    const save = vi.spyOn(api, "importMotion").mockResolvedValue({
      recording: { id: "new" } as Schemas["RecordingDetail"],
      understood: UNDERSTOOD,
    });
    const onSaved = vi.fn();
    show(<ImportMotion patientId="p" side="left" onSaved={onSaved} />);
    expect(enabled("Save as a recording")).toBe(false);
    give("lift.csv");
    const text = await screen.findByTestId("understood");
    expect(text.textContent).toContain(
      "Angles of the arm, 401 rows at 100\u00a0Hz, length 4\u00a0s, for the left shoulder.",
    );
    expect(text.textContent).toContain("Ignored columns: remark.");
    expect(text.textContent).toContain(
      "Smallest margin to the limit of what the arm can reach: 12.5° at 3.2\u00a0s",
    );
    expect(text.textContent).toContain("Simulated apparatus");
    expect(preview).toHaveBeenCalledWith("p", "left", expect.any(File));
    press("Save as a recording");
    await waitFor(() => expect(onSaved).toHaveBeenCalledWith("new"));
    expect(save).toHaveBeenCalledWith(
      "p",
      { name: "lift", side: "left", taught_by: "Ito Mai" },
      expect.any(File),
    );
  });

  it("with errors is refused line by line", async () => {
    vi.spyOn(api, "previewMotion").mockRejectedValue(
      new ProblemError({
        detail: "This file cannot be used.",
        errors: [
          {
            pointer: "line 3, column time_s",
            field: "",
            detail: "'x' is not a number",
            field_key: null,
            detail_key: null,
          },
          {
            pointer: "line 9, column time_s",
            field: "",
            detail: "'y' is not a number",
            field_key: null,
            detail_key: null,
          },
        ],
      }),
    );
    show(<ImportMotion patientId="p" side="left" onSaved={vi.fn()} />);
    give("lift.csv");
    const places = await screen.findByTestId("places");
    expect(places.textContent).toBe(
      "line 3, column time_s: 'x' is not a numberline 9, column time_s: 'y' is not a number",
    );
    expect(screen.getByText("2 errors in this file")).toBeTruthy();
    expect(enabled("Save as a recording")).toBe(false);
  });
});

it("imports patients after file and shoulder are chosen", async () => {
  const bring = vi.spyOn(api, "importPatients").mockResolvedValue({
    items: [PATIENT],
    left_out: ["Patient.telecom"],
    left_out_further: 2,
  });
  show(<ImportPatients />);
  press("Import");
  await screen.findByRole("dialog");
  give("patients.json");
  const button = () => screen.getAllByRole("button", { name: "Import" }).at(-1) as HTMLButtonElement;
  expect(button().disabled).toBe(true);
  fireEvent.click(screen.getByLabelText("Left shoulder is treated"));
  fireEvent.click(button());
  const text = await screen.findByTestId("imported");
  expect(text.textContent).toContain("Yamada Hanako, K-7");
  expect(text.textContent).toContain("Not imported: Patient.telecom.Not imported either: 2 items.");
  expect(bring).toHaveBeenCalledWith("left", expect.any(File));
});

describe("erasure", () => {
  it("is requested with a reason in the user's name", async () => {
    vi.spyOn(api, "erasures").mockResolvedValue({ items: [], next: null });
    const note = vi.spyOn(api, "requestErasure").mockResolvedValue(ERASURE);
    show(<ErasureRequests patient={PATIENT} />);
    const section = await screen.findByRole("region", { name: "Erasure of the record" });
    fireEvent.click(within(section).getByRole("button", { name: "Record an erasure request" }));
    await screen.findByRole("dialog");
    type("How and why it was requested", "By letter");
    press("Record request");
    await waitFor(() => expect(note).toHaveBeenCalledWith("p", { reason: "By letter", noted_by: "Ito Mai" }));
  });

  it("is decided by administrators", async () => {
    authStore.signedIn({
      ...ME,
      permissions: ME.permissions.filter((permission) => permission !== "administer"),
    });
    vi.spyOn(api, "erasures").mockResolvedValue({ items: [ERASURE], next: null });
    show(<ErasureRequests patient={PATIENT} />);
    expect(await screen.findByText("An administrator decides.")).toBeTruthy();
    expect(screen.queryByRole("button")).toBeNull();
  });

  it("needs the clinic number, and a refusal an explanation", async () => {
    vi.spyOn(api, "erasures").mockResolvedValue({ items: [ERASURE], next: null });
    const erase = vi.spyOn(api, "erasePatient").mockResolvedValue(ERASURE);
    show(<ErasureRequests patient={PATIENT} />);
    fireEvent.click(await screen.findByRole("button", { name: "Decide on the erasure" }));
    await screen.findByRole("dialog");
    expect(enabled("Refuse and keep the record")).toBe(false);
    type(/enter the clinic number of Yamada Hanako/, "K-8");
    expect(enabled("Erase permanently")).toBe(false);
    type(/enter the clinic number of Yamada Hanako/, "K-7");
    press("Erase permanently");
    await waitFor(() =>
      expect(erase).toHaveBeenCalledWith("e", {
        clinic_number: "K-7",
        explanation: "",
        decided_by: "Ito Mai",
      }),
    );
  });
});
