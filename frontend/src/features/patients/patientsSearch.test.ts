import { expect, it } from "vitest";
import { readPatientsSearch } from "./patientsSearch";

it("the address of the list has the text and the filter as far as they are valid", () => {
  const valid = { register: true, search: "Sato Hanako", archived: true };
  expect(readPatientsSearch({ ...valid, page: 3 })).toEqual(valid);
  expect(readPatientsSearch({ register: "yes", search: "", archived: false })).toEqual({});
  expect(readPatientsSearch({ search: 123 })).toEqual({ search: "123" });
  expect(readPatientsSearch({ search: "a".repeat(101) })).toEqual({ search: "a".repeat(100) });
});
