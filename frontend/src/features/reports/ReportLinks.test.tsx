import { MantineProvider } from "@mantine/core";
import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, beforeEach, describe, expect, it } from "vitest";
import { ReportLinks } from "./ReportLinks";

const show = (of: "sessions" | "episodes" = "sessions") =>
  render(
    <MantineProvider env="test">
      <ReportLinks of={of} id="s1" />
    </MantineProvider>,
  );
const address = (name: string) => screen.getByRole("link", { name }).getAttribute("href");

beforeEach(() => localStorage.clear());
afterEach(cleanup);

describe("a report", () => {
  it("opens in another tab and as PDF", () => {
    show();
    expect(address("Print report")).toBe("/api/sessions/s1/report.html?language=en");
    expect(screen.getByRole("link", { name: "Print report" }).getAttribute("target")).toBe("_blank");
    expect(address("Report as PDF")).toBe("/api/sessions/s1/report.pdf?language=en");
    expect(screen.getByRole("link", { name: "Report as PDF" }).hasAttribute("download")).toBe(true);
  });

  it("keeps its language for the next report", () => {
    show();
    fireEvent.click(screen.getByRole("radio", { name: "日本語" }));
    expect(address("Print report")).toBe("/api/sessions/s1/report.html?language=ja");
    cleanup();
    show();
    expect(address("Report as PDF")).toBe("/api/sessions/s1/report.pdf?language=ja");
  });

  it("offers the Japanese rehabilitation plan with an episode in Japanese only", () => {
    const plan = () => screen.queryByRole("link", { name: "Rehabilitation plan, draft (PDF)" });
    show("episodes");
    expect(plan()).toBeNull();
    fireEvent.click(screen.getByRole("radio", { name: "日本語" }));
    expect(plan()?.getAttribute("href")).toBe("/api/episodes/s1/rehabilitation-plan.pdf");
    cleanup();
    show("sessions");
    expect(plan()).toBeNull();
  });

  it("is English after an invalid stored language", () => {
    localStorage.setItem("kata.report-language", "nonsense");
    show();
    expect(address("Report as PDF")).toBe("/api/sessions/s1/report.pdf?language=en");
  });
});
