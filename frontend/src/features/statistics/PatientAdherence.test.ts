import { expect, it } from "vitest";
import { sumsOf } from "./adherence";
import { shareOf, shareOfAll } from "./PatientAdherence";

it.each([
  [{ held: 3, prescribed: 4 }, 0.75],
  [{ held: 6, prescribed: 4 }, 1],
  [{ held: 0, prescribed: 4 }, 0],
  [{ held: 1, prescribed: 0 }, null],
])("the share of %o is %s", (row, share) => expect(shareOf(row)).toBe(share));

it("counts no extra session of one patient for another", () => {
  const rows = [
    { held: 6, prescribed: 4, due_at: "2026-11-29T00:00:00Z" },
    { held: 2, prescribed: 4, due_at: "2026-11-30T00:00:00Z" },
  ];
  expect(shareOfAll(rows)).toBe("75\u00a0%");
  expect(sumsOf(rows, "2026-11-30")).toEqual({ programmes: 2, overdue: 1, prescribed: 8, held: 6 });
});
