import { MantineProvider } from "@mantine/core";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { HelpLink, type HelpTopic } from "./HelpLink";

function show(topic: HelpTopic, installed: "yes" | "no") {
  const meta = document.createElement("meta");
  meta.name = "kata-manual";
  meta.content = installed;
  document.head.replaceChildren(meta);
  render(
    <MantineProvider env="test">
      <HelpLink topic={topic} subject="Play" />
    </MantineProvider>,
  );
  return screen.queryByRole("link", { name: "Help: Play" })?.getAttribute("href");
}

afterEach(() => {
  cleanup();
  document.head.replaceChildren();
});

it.each([
  ["playing", "/docs/manual/en/#help-playing"],
  ["dose", "/docs/manual/en/dose.html"],
  ["backups", "/docs/how-to/back-up-and-restore.html"],
] as const)("leads from %s to its section", (topic, address) => expect(show(topic, "yes")).toBe(address));

it("is absent without a manual", () => expect(show("playing", "no")).toBeUndefined());
