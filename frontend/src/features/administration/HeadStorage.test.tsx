import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, test } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { HeadStorage } from "./HeadStorage";

const NOWHERE: Schemas["AuditHeads"] = {
  elsewhere: [],
  copy_file: null,
  failing_since: null,
  log: false,
  other_stations: false,
};

const show = (heads: Partial<Schemas["AuditHeads"]>) =>
  render(
    <MantineProvider env="test">
      <HeadStorage heads={{ ...NOWHERE, ...heads }} />
    </MantineProvider>,
  );

afterEach(cleanup);

test("without a place outside this computer the page says what can be removed", () => {
  show({});
  expect(screen.getByTestId("audit-heads").textContent).toMatch(
    /Nothing outside this computer is configured/,
  );
});

test("the page names every place that stores the heads", () => {
  show({ elsewhere: ["/mnt/audit/copy.anchor"], other_stations: true, log: true });
  const text = screen.getByTestId("audit-heads").textContent;
  expect(text).toMatch(/\/mnt\/audit\/copy\.anchor.*other stations.*In the log/);
  expect(text).not.toMatch(/Nothing outside/);
});

test("a copy that cannot be written is an alert", () => {
  show({ copy_file: "/mnt/audit/copy.anchor", failing_since: "2026-11-25T04:00:00Z" });
  expect(screen.getByTestId("audit-copy-failing").textContent).toMatch(
    /copy\.anchor cannot be written since/,
  );
});
