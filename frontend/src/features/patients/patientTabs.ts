/** The tabs of a patient's page, in order. The address contains the open tab. */
const PATIENT_TABS = [
  "summary",
  "episodes",
  "assessments",
  "recordings",
  "programmes",
  "sessions",
  "data",
] as const;
export type PatientTab = (typeof PATIENT_TABS)[number];

/** Return the tab in an address. An unknown tab is left out. */
export function readPatientTab(search: Record<string, unknown>): { tab?: PatientTab } {
  const tab = PATIENT_TABS.find((name) => name === search.tab);
  return tab && tab !== "summary" ? { tab } : {};
}
