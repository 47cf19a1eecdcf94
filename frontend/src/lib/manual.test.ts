import { afterEach, expect, test } from "vitest";
import { manualAddress } from "./manual";

afterEach(() => {
  document.head.innerHTML = "";
});

test.each([
  ["yes", "/docs/manual/en/"],
  ["no", null],
  ["KATA-MANUAL", null],
])("links to the manual if the service says %s", (content, address) => {
  document.head.innerHTML = `<meta name="kata-manual" content="${content}" />`;
  expect(manualAddress()).toBe(address);
});

test("without the service's answer there is no link", () => expect(manualAddress()).toBeNull());
