import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { api, type Patient, ProblemError } from "../../lib/api/client";
import { PatientForm } from "./PatientForm";
import { PatientSelect } from "./PatientSelect";

const PATIENT: Patient = {
  id: "p",
  clinic_number: "K-1",
  name: "Satō Ken",
  kana: "サトウ ケン",
  birth_date: "1968-04-12",
  sex: "male",
  dominant_side: "right",
  affected_side: "left",
  episode_id: null,
  notes: "",
  created_at: "2026-11-21T09:30:00Z",
  updated_at: "2026-11-21T09:30:00Z",
  archived_at: null,
  erased_at: null,
  restricted: false,
};

const create = vi.spyOn(api, "createPatient");
const update = vi.spyOn(api, "updatePatient");
const find = vi.spyOn(api, "patients");
const onDone = vi.fn();

const within = (shown: React.ReactNode) => (
  <MantineProvider env="test">
    <QueryClientProvider client={new QueryClient()}>{shown}</QueryClientProvider>
  </MantineProvider>
);
const type = (label: RegExp | string, value: string) =>
  fireEvent.change(screen.getByLabelText(label), { target: { value } });
const press = (name: string) => fireEvent.click(screen.getByRole("button", { name }));

beforeEach(() => {
  vi.resetAllMocks();
  create.mockResolvedValue(PATIENT);
  update.mockResolvedValue(PATIENT);
  find.mockResolvedValue({ items: [PATIENT], next: null });
});
afterEach(cleanup);

describe("the form of a patient", () => {
  it("creates a patient with treated and dominant side", async () => {
    render(within(<PatientForm onDone={onDone} />));
    type(/^Name/, "Ito Mai");
    type(/^Clinic number/, "K-2");
    fireEvent.click(screen.getByRole("radio", { name: "Right" }));
    fireEvent.click(screen.getByRole("combobox", { name: "Dominant side" }));
    fireEvent.click(screen.getByRole("option", { name: "Left" }));
    press("Register");
    await waitFor(() => expect(onDone).toHaveBeenCalledWith(PATIENT));
    expect(create.mock.calls[0]?.[0]).toMatchObject({
      name: "Ito Mai",
      clinic_number: "K-2",
      affected_side: "right",
      dominant_side: "left",
      birth_date: null,
    });
  });

  it("shows each error at its field", async () => {
    const errors = [
      {
        pointer: "#/birth_date",
        field: "birth date",
        detail: "must be between 1900 and today",
        field_key: null,
        detail_key: null,
      },
    ];
    update.mockRejectedValue(new ProblemError({ detail: "Please check what was entered.", errors }));
    render(within(<PatientForm patient={PATIENT} onDone={onDone} />));
    press("Save");
    await screen.findByText("must be between 1900 and today");
    // The button was disabled meanwhile. Without a focus, a keyboard starts at the top of the page.
    expect(document.activeElement).toBe(screen.getByLabelText("Birth date"));
    expect(onDone).not.toHaveBeenCalled();
  });

  it("does not adopt a newer version during editing", async () => {
    const shown = render(within(<PatientForm patient={PATIENT} onDone={onDone} />));
    type(/^Notes/, "Mine");
    const newer = { ...PATIENT, notes: "Theirs", updated_at: "2026-11-21T10:00:00Z" };
    shown.rerender(within(<PatientForm patient={newer} onDone={onDone} />));
    press("Save");
    await waitFor(() =>
      expect(update.mock.calls[0]?.[1]).toMatchObject({ notes: "Mine", updated_at: PATIENT.updated_at }),
    );
  });
});

describe("choosing a patient", () => {
  it("asks the service, which searches hidden fields too", async () => {
    const onChange = vi.fn();
    render(within(<PatientSelect chosen={undefined} onChange={onChange} />));
    const box = screen.getByRole("combobox", { name: "Patient" });
    await userEvent.type(box, "さとう");
    await waitFor(() => expect(find.mock.calls.at(-1)).toEqual(["さとう", false]));
    fireEvent.click(await screen.findByRole("option", { name: "Satō Ken (K-1)" }));
    expect(onChange.mock.calls[0]?.[0]).toBe("p");
  });

  it("shows the chosen patient outside the loaded list", async () => {
    find.mockResolvedValue({ items: [], next: null });
    render(within(<PatientSelect chosen={PATIENT} onChange={vi.fn()} />));
    await waitFor(() =>
      expect(screen.getByRole("combobox", { name: "Patient" })).toHaveProperty("value", "Satō Ken (K-1)"),
    );
  });
});
