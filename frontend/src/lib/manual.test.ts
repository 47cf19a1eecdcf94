import { afterEach, expect, test } from "vitest";
import { manualAddress } from "./manual";

afterEach(() => {
  document.head.replaceChildren();
});

test.each([
  ["yes", "/docs/manual/en/"],
  ["no", null],
  ["KATA-MANUAL", null],
])("links to the manual if the service says %s", (content, address) => {
  const meta = document.createElement("meta");
  meta.name = "kata-manual";
  meta.content = content;
  document.head.replaceChildren(meta);
  expect(manualAddress()).toBe(address);
});

test("without the service's answer there is no link", () => expect(manualAddress()).toBeNull());
