import { readdirSync, readFileSync } from "node:fs";
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, fireEvent, render, screen, waitFor } from "@testing-library/react";
import type { ReactNode } from "react";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { api, ProblemError, type Schemas } from "../../lib/api/client";
import { Contraindications } from "./Contraindications";
import { BANNER, FRACTURE, REPAIR } from "./examples";
import { PatientBanner } from "./PatientBanner";
import { exceededSettings, StageWarning } from "./StageWarning";

function show(page: ReactNode) {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient({ defaultOptions: { queries: { retry: false } } })}>
        {page}
      </QueryClientProvider>
    </MantineProvider>,
  );
}

beforeEach(() => {
  vi.restoreAllMocks();
});
afterEach(cleanup);

describe("the patient banner", () => {
  it("says who it is, which shoulder and stage, and what stops a motion", async () => {
    vi.spyOn(api, "patientBanner").mockResolvedValue(BANNER);
    show(<PatientBanner patientId="p" />);
    await screen.findByText("Yamada Hanako");
    const words = screen.getByTestId("patient-banner").textContent ?? "";
    for (const part of ["ヤマダ ハナコ", "age 58", "K-0042", "Left shoulder, Freezing", "No traction."]) {
      expect(words).toContain(part);
    }
    expect(words).toContain("Fracture that has not united, Left: Teaching and playback are not allowed.");
  });

  it("shows a doctor's permission beside the condition", async () => {
    const allowed = {
      ...REPAIR,
      signed_off_at: "2026-11-02T09:00:00Z",
      signed_off_by: "Dr. Mori",
      stops_motion: false,
    };
    vi.spyOn(api, "patientBanner").mockResolvedValue({ ...BANNER, contraindications: [allowed] });
    show(<PatientBanner patientId="p" />);
    expect(await screen.findByText(/Allowed by Dr. Mori/)).toBeTruthy();
  });

  it("says that nothing is recorded, and never hides that it cannot be loaded", async () => {
    const clear = BANNER.shoulders.map((shoulder) => ({ ...shoulder, contraindications: "" }));
    const load = vi
      .spyOn(api, "patientBanner")
      .mockResolvedValueOnce({ ...BANNER, shoulders: clear, contraindications: [] });
    show(<PatientBanner patientId="p" />);
    expect(await screen.findByText("No contraindication is recorded.")).toBeTruthy();
    cleanup();
    load.mockRejectedValue(new ProblemError({ detail: "away", code: "database_away" }));
    show(<PatientBanner patientId="p" name="Yamada Hanako" />);
    expect(await screen.findByText(/Yamada Hanako .*Ask for the contraindications/)).toBeTruthy();
  });

  it("shows nothing of a restricted record", async () => {
    const load = vi
      .spyOn(api, "patientBanner")
      .mockRejectedValue(new ProblemError({ detail: "restricted", code: "restricted" }));
    show(<PatientBanner patientId="p" name="Yamada Hanako" />);
    await waitFor(() => expect(load).toHaveBeenCalled());
    await waitFor(() => expect(screen.queryByText(/Yamada/)).toBeNull());
  });

  it("is on every page of a patient", () => {
    const router = readFileSync("src/app/router.tsx", "utf8");
    const pages = [
      ...router.matchAll(
        /path: "[^"]*\$\w*Id[^"]*",\s*component: lazyRouteComponent\(\s*\(\) => import\("\.\.\/([^"]+)"\)/g,
      ),
    ];
    expect(pages.length).toBe(router.match(/path: "[^"]*\$\w*Id/g)?.length);
    // The banner names the patient, and it leads to the patient unless it is on the patient's own page.
    for (const [, page] of pages)
      expect(readFileSync(`src/${page}.tsx`, "utf8"), page).toMatch(/<PatientBanner[^>]*\s(link|heading)\b/);
    expect(readFileSync("src/features/station/StationPage.tsx", "utf8")).toContain("<PatientBanner");
    expect(readdirSync("src/features/patients")).toContain("PatientBanner.tsx");
  });
});

describe("the stage's proposal", () => {
  const proposal = BANNER.shoulders[0]?.proposal as Schemas["StageProposal"];
  const settings = { speed_percent: 50, range_percent: 80, repetitions: 5 };

  it("is exceeded only above its values", () => {
    expect(exceededSettings(proposal, settings, 8)).toEqual([]);
    expect(exceededSettings(proposal, settings, null)).toEqual([]);
    expect(exceededSettings(proposal, { ...settings, speed_percent: 51, repetitions: 6 }, 9)).toEqual([
      "resistance_level",
      "speed_percent",
      "repetitions",
    ]);
  });

  it("warns with its source and says that nothing is changed", async () => {
    vi.spyOn(api, "patientBanner").mockResolvedValue(BANNER);
    show(
      <StageWarning
        patientId="p"
        episodeId="e"
        settings={{ ...settings, range_percent: 100 }}
        resistanceLevel={8}
      />,
    );
    const warning = await screen.findByRole("status");
    expect(warning.textContent).toContain(
      "These settings are above the proposal for the stage Freezing: range.",
    );
    expect(screen.getByTestId("stage-proposal").textContent).toContain("Kelley et al.");
  });

  it("has its source without a warning, too", async () => {
    vi.spyOn(api, "patientBanner").mockResolvedValue(BANNER);
    show(<StageWarning patientId="p" episodeId="e" settings={settings} resistanceLevel={8} />);
    expect((await screen.findByTestId("stage-proposal")).textContent).toContain("Kelley et al.");
    expect(screen.queryByRole("status")).toBeNull();
  });
});

describe("the contraindications", () => {
  it("are recorded with their effect, permitted by a doctor and resolved with a reason", async () => {
    vi.spyOn(api, "contraindications").mockResolvedValue({ items: [FRACTURE, REPAIR], next: null });
    vi.spyOn(api, "contraindicationKinds").mockResolvedValue({ items: [FRACTURE, REPAIR], next: null });
    vi.spyOn(api, "episodes").mockResolvedValue({ items: [], next: null });
    const signOff = vi.spyOn(api, "signOffContraindication").mockResolvedValue(REPAIR);
    const resolve = vi.spyOn(api, "resolveContraindication").mockResolvedValue(FRACTURE);
    show(<Contraindications patientId="p" />);
    await screen.findByText("Teaching and playback are not allowed.");
    // No doctor can permit a treatment with a fracture.
    expect(screen.getAllByLabelText("Doctor who allows it")).toHaveLength(1);
    fireEvent.change(screen.getByLabelText("Doctor who allows it"), { target: { value: "Dr. Mori" } });
    fireEvent.click(screen.getByRole("button", { name: "Record the permission" }));
    await waitFor(() => expect(signOff).toHaveBeenCalledWith("c2", { doctor: "Dr. Mori" }));
    const reason = screen.getAllByLabelText("Why it no longer applies")[0] as HTMLElement;
    fireEvent.change(reason, { target: { value: "United." } });
    fireEvent.click(screen.getAllByRole("button", { name: "Resolve" })[0] as HTMLElement);
    await waitFor(() =>
      expect(resolve).toHaveBeenCalledWith("c1", { reason: "United.", resolved_by: "Ito Mai" }),
    );
  });

  it("say who had allowed and who resolved them", async () => {
    const resolved = {
      ...REPAIR,
      signed_off_at: "2026-05-01T09:00:00Z",
      signed_off_by: "Dr. Mori",
      resolved_at: "2026-05-08T09:00:00Z",
      resolved_by: "Ito Mai",
      resolution: "Healed.",
    };
    vi.spyOn(api, "contraindications").mockResolvedValue({ items: [resolved], next: null });
    vi.spyOn(api, "contraindicationKinds").mockResolvedValue({ items: [], next: null });
    vi.spyOn(api, "episodes").mockResolvedValue({ items: [], next: null });
    show(<Contraindications patientId="p" />);
    expect(await screen.findByText("Allowed by Dr. Mori.")).toBeTruthy();
    expect(screen.getByText(/Resolved by Ito Mai, .*: Healed\./)).toBeTruthy();
    expect(screen.queryByRole("button", { name: "Resolve" })).toBeNull();
  });
});
