import { expect, it } from "vitest";
import { shareOf, shareOfAll } from "./PatientAdherence";

it.each([
  [{ held: 3, prescribed: 4 }, 0.75],
  [{ held: 6, prescribed: 4 }, 1],
  [{ held: 0, prescribed: 4 }, 0],
  [{ held: 1, prescribed: 0 }, null],
])("the share of %o is %s", (row, share) => expect(shareOf(row)).toBe(share));

it("counts no extra session of one patient for another", () => {
  const rows = [
    { held: 6, prescribed: 4 },
    { held: 2, prescribed: 4 },
  ];
  expect(shareOfAll(rows)).toBe("75\u00a0%");
});
