import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { authStore } from "../features/auth/authState";
import { ME, VIEWER } from "../features/auth/testUsers";
import { MissingZone } from "./MissingZone";
import { TestRouter } from "./TestRouter";

function show() {
  render(
    <MantineProvider env="test">
      <TestRouter>
        <MissingZone />
      </TestRouter>
    </MantineProvider>,
  );
}

afterEach(() => {
  cleanup();
  authStore.signedIn(ME);
});

it("asks an administrator for the missing time zone", () => {
  authStore.signedIn({ ...ME, time_zone: "" });
  show();
  const note = screen.getByTestId("missing-zone");
  expect(note.textContent).toContain("The clinic has no time zone. All days and times are UTC.");
  expect(screen.getByRole("link", { name: "Set the time zone" }).getAttribute("href")).toBe(
    "/administration/clinic",
  );
});

it("tells everyone else that days and times are those of UTC", () => {
  authStore.signedIn({ ...VIEWER, time_zone: "" });
  show();
  expect(screen.getByTestId("missing-zone").textContent).toContain("All days and times are UTC.");
  expect(screen.queryByRole("link")).toBeNull();
});

it("says that the browser does not know the clinic's time zone", () => {
  authStore.signedIn({ ...ME, time_zone: "Mars/Olympus" });
  show();
  expect(screen.getByTestId("missing-zone").textContent).toContain(
    "does not know the time zone Mars/Olympus",
  );
});

it("says nothing about the clinic's own time zone", () => {
  authStore.signedIn({ ...ME, time_zone: "Asia/Tokyo" });
  show();
  expect(screen.queryByTestId("missing-zone")).toBeNull();
});
