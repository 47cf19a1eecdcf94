import "./catalogue";
import "../commissioning/catalogue";
import type { Page } from "../../app/pages";
import { t } from "../../lib/i18n";

/** The sections of the administration. The search finds them, too. */
export const ADMINISTRATION_PAGES = [
  { to: "/administration/accounts", label: t("administration:accounts.title"), needs: "administer" },
  { to: "/administration/audit", label: t("administration:audit.title"), needs: "administer" },
  {
    to: "/administration/emergency-access",
    label: t("administration:breakGlassAccesses.title"),
    needs: "administer",
  },
  { to: "/administration/backups", label: t("administration:backups.title"), needs: "administer" },
  { to: "/administration/clinic", label: t("administration:clinic.title"), needs: "administer" },
  { to: "/commissioning", label: t("commissioning:page.title"), needs: "commission" },
] as const satisfies readonly Page[];
