/**
 * Every number that a dialog of programmes, imports, erasures and commissioning records shows has a unit, a scale or a word for
 * what is counted, in both languages. The rule is that of the walks in a browser (tests/support/units.py).
 */
import { readFileSync } from "node:fs";
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import type { ReactElement } from "react";
import { afterEach, beforeAll, describe, expect, it, vi } from "vitest";
import bareNumbers from "../../../tests/support/bare_numbers.js";
import { ERASURE, PATIENT, UNDERSTOOD } from "../features/import-export/testData";
import { TestRouter } from "./TestRouter";

type Language = "en" | "ja";
const WORDS: Record<Language, Record<string, string & string[]>> = JSON.parse(
  readFileSync("../tests/support/unit_words.json", "utf8"),
);

const MOMENT = "2026-11-21T09:30:00Z";
const RECORD = {
  id: "c",
  kind: "full",
  done_by: "Ito Mai",
  began_at: MOMENT,
  ended_at: MOMENT,
  passed: true,
  fault: "",
  figures: [],
  digest: "3f9a",
};

/** Load the page's modules in a language. */
async function inLanguage(language: Language) {
  vi.resetModules();
  localStorage.setItem("kata.language", language);
  const { authStore } = await import("../features/auth/authState");
  const { ME } = await import("../features/auth/testUsers");
  authStore.signedIn(ME);
  const { api, ProblemError } = await import("../lib/api/client");
  const { t } = await import("../lib/i18n");
  return { api, ProblemError, t };
}
type Page = Awaited<ReturnType<typeof inLanguage>>;

const show = (element: ReactElement) =>
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient({ defaultOptions: { queries: { retry: false } } })}>
        <TestRouter>
          <main>{element}</main>
        </TestRouter>
      </QueryClientProvider>
    </MantineProvider>,
  );
const give = (name: string) => {
  const input = document.querySelector("input[type=file]") as HTMLInputElement;
  fireEvent.change(input, { target: { files: [new File(["time_s"], name)] } });
};

/** Return the number fields that show no unit and whose label names nothing that is counted. */
function bareFields(language: Language): string[] {
  const words = WORDS[language];
  const named = new RegExp([words.units_after, words.scales, ...(words.count_heads ?? [])].join("|"));
  return [
    ...document.querySelectorAll<HTMLInputElement>("input[inputmode=decimal], input[inputmode=numeric]"),
  ]
    .filter((input) => /\d/.test(input.value) && /^[\d.,−-]+$/.test(input.value))
    .map((input) => `${input.getAttribute("aria-label")} ${input.value}`)
    .filter((field) => !named.test(field));
}
const bare = (language: Language) => [...bareNumbers(WORDS[language] ?? {}), ...bareFields(language)];
const shown = () => document.body.textContent ?? "";

// jsdom draws nothing, so it does not know what is visible.
beforeAll(() => {
  Element.prototype.checkVisibility = () => true;
});
afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

describe.each([["en"], ["ja"]] as const)("in the language %s", (language) => {
  let page: Page;
  beforeAll(async () => {
    page = await inLanguage(language);
  });

  it("the walk finds a number without a unit, in text and field", () => {
    show(
      <>
        <p>Lift 95</p>
        <input inputMode="decimal" aria-label="Lift" defaultValue="94" />
      </>,
    );
    expect(bare(language)).toEqual(['95 in "Lift 95"', "Lift 94"]);
  });

  it("the import of a motion has units, side and length", async () => {
    const { api } = page;
    vi.spyOn(api, "previewMotion").mockResolvedValue(UNDERSTOOD);
    const { ImportMotion } = await import("../features/import-export/ImportMotion");
    show(<ImportMotion patientId="p" side="left" onSaved={() => {}} />);
    give("lift.csv");
    const { textContent } = await screen.findByTestId("understood");
    for (const number of ["401", "100", "12.5", "3.2"]) expect(textContent).toContain(number);
    expect(textContent).toMatch(/4(\u00a0s|秒)[,、]/);
    expect(textContent).toMatch(language === "en" ? /left shoulder/ : /左肩/);
    expect(textContent).toContain(language === "en" ? "Simulated apparatus" : "模擬装置");
    expect(bare(language)).toEqual([]);
  });

  it("a refused file names its lines and its number of errors", async () => {
    const { api, ProblemError } = page;
    const error = { pointer: "line 3, column time_s", field: "", field_key: null, detail_key: null };
    vi.spyOn(api, "previewMotion").mockRejectedValue(
      new ProblemError({ detail: "No.", errors: [{ ...error, detail: "'x' is not a number" }] }),
    );
    const { ImportMotion } = await import("../features/import-export/ImportMotion");
    show(<ImportMotion patientId="p" side="left" onSaved={() => {}} />);
    give("lift.csv");
    await screen.findByTestId("places");
    expect(bare(language)).toEqual([]);
  });

  it("the import of patients has no number without a unit", async () => {
    const { api, t } = page;
    vi.spyOn(api, "importPatients").mockResolvedValue({
      items: [PATIENT],
      left_out: ["Patient.telecom"],
      left_out_further: 2,
    });
    const { ImportPatients } = await import("../features/import-export/ImportPatients");
    show(<ImportPatients />);
    fireEvent.click(screen.getByRole("button"));
    await screen.findByRole("dialog");
    give("patients.json");
    fireEvent.click(screen.getByLabelText(t("import-export:fhir.sides.left")));
    fireEvent.click(screen.getAllByRole("button", { name: t("import-export:fhir.open") }).at(-1) as Element);
    await screen.findByTestId("imported");
    expect(shown()).toContain("K-7");
    expect(bare(language)).toEqual([]);
  });

  it("an erasure request has its time", async () => {
    const { api, t } = page;
    vi.spyOn(api, "erasures").mockResolvedValue({ items: [ERASURE], next: null });
    const { ErasureRequests } = await import("../features/import-export/ErasureRequests");
    show(<ErasureRequests patient={PATIENT} />);
    fireEvent.click(await screen.findByRole("button", { name: t("import-export:erasure.decide") }));
    const dialog = await screen.findByRole("dialog");
    expect(dialog.textContent).toMatch(/2026.*\d:\d\d/);
    expect(bare(language)).toEqual([]);
  });

  it("the settings of a programme's item have units and the shoulder", async () => {
    await openItem(page);
    const dialog = await screen.findByRole("dialog");
    fireEvent.click(screen.getByRole("switch", { name: page.t("programmes:endRange.title") }));
    expect(dialog.querySelectorAll("input[inputmode=decimal], input[inputmode=numeric]").length).toBe(7);
    expect(dialog.textContent).toContain(page.t("programmes:programme.shoulder.right"));
    expect(bare(language)).toEqual([]);
  });

  it("every value of a commissioning record has a unit, and the record its time", async () => {
    const { api, t } = page;
    const english = await import("../locales/en/commissioning.json");
    // These are texts, or names of texts.
    const names = Object.keys(english.default.values).filter(
      (name) => !/^(weight|empty|emergency stop|pedal)$|seen$/.test(name),
    );
    expect(names.length).toBeGreaterThan(40);
    const detail = {
      ...RECORD,
      signature: { state: "valid", changed: [], public_key: "cafe" },
      steps: [
        {
          step: "acceptance",
          began_at: MOMENT,
          ended_at: MOMENT,
          passed: true,
          fault: "",
          curves: [],
          values: names.map((name) => ({
            name: name.replaceAll("{load}", "weight").replaceAll(/\{\w+\}/g, "3"),
            motor: 2,
            before: 11,
            after: 12.5,
          })),
        },
      ],
    };
    vi.spyOn(api, "commissionings").mockResolvedValue({ items: [RECORD], next: null } as never);
    vi.spyOn(api, "commissioning").mockResolvedValue(detail as never);
    const { RecordsTab } = await import("../features/commissioning/RecordsTab");
    show(<RecordsTab station="Room 1" />);
    fireEvent.click(await screen.findByRole("button", { name: t("commissioning:records.steps") }));
    await screen.findByTestId("step");
    expect(screen.getByRole("dialog").textContent).toMatch(/2026.*\d:\d\d/);
    expect(screen.getAllByText("12.5")).toHaveLength(names.length);
    const rows = [...screen.getByRole("dialog").querySelectorAll("tbody tr")];
    const unit = new RegExp(WORDS[language].unit_last ?? "");
    expect(rows.map((row) => row.children[1]?.textContent ?? "").filter((name) => !unit.test(name))).toEqual(
      [],
    );
    expect(bare(language)).toEqual([]);
  });
});

/** Open the dialog of a programme's first item. */
async function openItem({ api, t }: Page) {
  const { AS_TAUGHT } = await import("../features/station/playSettingsModel");
  vi.spyOn(api, "recordings").mockResolvedValue({ items: [] } as never);
  vi.spyOn(api, "episodes").mockResolvedValue({ items: [], next: null } as never);
  vi.spyOn(api, "patient").mockResolvedValue({ affected_side: "right" } as never);
  vi.spyOn(api, "previewProgramme").mockResolvedValue({ duration_s: 30, items: [] } as never);
  const { ProgrammeEditor } = await import("../features/programmes/ProgrammeEditor");
  const item = {
    ...AS_TAUGHT,
    key: "one",
    recording_id: "r",
    recording_name: "Lift",
    repetitions: 10,
    resistance_level: 8,
    self_paced: false,
    end_range: null,
  };
  show(
    <ProgrammeEditor
      patientId="p"
      episode={{ id: "e", side: "right" }}
      start={{ items: [item], timer_minutes: 20, sessions_per_week: 3 }}
      draftKey={`shown ${Math.random()}`}
      saveLabel="Save"
      onSave={async () => {}}
      onCancel={() => {}}
    />,
  );
  await waitFor(() => expect(screen.getByTestId("whole")).toBeTruthy());
  fireEvent.click(
    screen.getByRole("button", { name: t("programmes:items.settingsOf", { recording: "Lift" }) }),
  );
}
