/** The tabs of the page, in order. The address contains the open tab. */
const COMMISSIONING_TABS = ["records", "procedure", "settings", "history"] as const;
export type CommissioningTab = (typeof COMMISSIONING_TABS)[number];
/** The open tab, and the versions that the configuration tab compares. */
type CommissioningSearch = { tab?: CommissioningTab; version?: number; other?: number };

const versionOf = (value: unknown) =>
  typeof value === "number" && Number.isInteger(value) && value > 0 ? value : undefined;

/** Return the choices in an address. The defaults are the first tab and the newest version. */
export function readCommissioningSearch(search: Record<string, unknown>): CommissioningSearch {
  const tab = COMMISSIONING_TABS.find((name) => name === search.tab);
  const [version, other] = [versionOf(search.version), versionOf(search.other)];
  return {
    ...(tab && tab !== "records" && { tab }),
    ...(version && { version }),
    ...(other && { other }),
  };
}
