/** Longest text to search for. */
export const LONGEST_SEARCH = 100;

/** The form for a new patient, the text to search for, and whether archived patients are listed, as in the address. */
export type PatientsSearch = { register?: true; search?: string; archived?: true };

/** Return the valid choices in the address of the list of patients. */
export function readPatientsSearch(address: Record<string, unknown>): PatientsSearch {
  const { register, search, archived } = address;
  // A clinic number can be numeric.
  const words = typeof search === "string" || typeof search === "number" ? String(search) : "";
  return {
    ...(register === true && { register: true }),
    ...(words && { search: words.slice(0, LONGEST_SEARCH) }),
    ...(archived === true && { archived: true }),
  };
}
