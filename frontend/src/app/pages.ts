import type { Permission } from "../features/auth/hooks";
import { t } from "../lib/i18n";

/**
 * A page that navigation and search offer to users with the permission. `parts`: the starts of other addresses that belong to
 * it; with `partsWithout`, only for users without that permission.
 */
export type Page = {
  to: string;
  label: string;
  needs: Permission;
  parts?: readonly string[];
  partsWithout?: Permission;
};

/** The pages of the navigation. The search finds them, too. */
export const PAGES = [
  { to: "/", label: t("common:shell.home"), needs: "see_station" },
  {
    to: "/station",
    label: t("common:shell.station"),
    needs: "see_station",
    // An administrator comes from the pages of the administration.
    parts: ["/commissioning"],
    partsWithout: "administer",
  },
  { to: "/stations", label: t("common:shell.stations"), needs: "see_station" },
  {
    to: "/patients",
    label: t("common:shell.patients"),
    needs: "read_records",
    parts: ["/episodes/", "/programmes/", "/recordings/"],
  },
  { to: "/sessions", label: t("common:shell.sessions"), needs: "read_records" },
  { to: "/clinic", label: t("common:shell.clinic"), needs: "see_station" },
  {
    to: "/administration",
    label: t("common:shell.administration"),
    needs: "administer",
    parts: ["/commissioning"],
  },
] as const satisfies readonly Page[];
