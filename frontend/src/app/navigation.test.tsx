import { readFileSync } from "node:fs";
import { MantineProvider } from "@mantine/core";
import { createMemoryHistory } from "@tanstack/react-router";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { AccountMenu } from "../features/auth/AccountMenu";
import { authStore } from "../features/auth/authState";
import { VIEWER } from "../features/auth/testUsers";
import { NavigationLink } from "./NavigationLink";
import { PAGES } from "./pages";
import { TestRouter } from "./TestRouter";

/** Pages without a navigation, and the page for developers. */
const OUTSIDE = ["/sign-in", "/set-up", "/set-password", "/design"];

const ROUTES = [
  ...readFileSync("src/app/router.tsx", "utf8").matchAll(
    /getParentRoute: \(\) => rootRoute,\s+path: "(.+)"/g,
  ),
].flatMap(([, path]) => (path && !OUTSIDE.includes(path) ? [path] : []));

/** Show the navigation on a page. Return the names of the items that are marked as current. */
function currentOn(path: string): string[] {
  render(
    <MantineProvider env="test">
      <TestRouter history={createMemoryHistory({ initialEntries: [path] })}>
        {PAGES.map((page) => (
          <NavigationLink key={page.to} {...page} />
        ))}
        <AccountMenu />
      </TestRouter>
    </MantineProvider>,
  );
  return [...screen.getAllByRole("link"), screen.getByRole("button")]
    .filter((item) => item.getAttribute("aria-current") === "page")
    .map((item) => item.textContent ?? "");
}

afterEach(cleanup);

it("finds the routes", () => {
  expect(ROUTES).toContain("/programmes/$programmeId");
  expect(ROUTES.length).toBeGreaterThan(12);
});

it.each(ROUTES)("marks one item as current on %s", (path) => {
  expect(currentOn(path)).toHaveLength(1);
});

it.each([
  ["/episodes/1/progress", "Patients"],
  ["/programmes/1", "Patients"],
  ["/recordings/1", "Patients"],
  ["/patients/1/programmes/new", "Patients"],
  ["/commissioning", "Administration"],
  ["/stations", "Stations"],
  ["/account", "Ito Mai"],
])("on %s marks %s", (path, name) => {
  expect(currentOn(path)).toEqual([name]);
});

it("marks the station for a technician, whose station page leads to the commissioning", () => {
  authStore.signedIn({ ...VIEWER, permissions: [...VIEWER.permissions, "commission"] });
  expect(currentOn("/commissioning")).toEqual(["Station"]);
});
