import "./catalogue";
import "../commissioning/catalogue";
import { Group, Stack, Title } from "@mantine/core";
import { Link, Outlet } from "@tanstack/react-router";
import classes from "../../app/Shell.module.css";
import { t } from "../../lib/i18n";
import { useHasPermission } from "../auth/hooks";

const TABS = [
  { to: "/administration/accounts", label: t("administration:accounts.title") },
  { to: "/administration/audit", label: t("administration:audit.title") },
  { to: "/administration/emergency-access", label: t("administration:emergencies.title") },
  { to: "/administration/backups", label: t("administration:backups.title") },
  { to: "/administration/clinic", label: t("administration:clinic.title") },
  { to: "/commissioning", label: t("commissioning:page.title") },
] as const;

/** The administrator's pages: accounts, audit trail, emergency access, backups, clinic, and the link to the station's settings. */
export function AdministrationPage() {
  const administers = useHasPermission("administer");
  return (
    <Stack>
      <Title order={1} size="h2">
        {t("administration:administration.title")}
      </Title>
      {administers && (
        <>
          <Group component="nav" gap={4} aria-label={t("administration:administration.sections")}>
            {TABS.map(({ to, label }) => (
              <Link
                key={to}
                to={to}
                className={classes.page ?? ""}
                activeProps={{ className: classes.here ?? "", "aria-current": "page" }}
                activeOptions={{ includeSearch: false }}
              >
                {label}
              </Link>
            ))}
          </Group>
          <Outlet />
        </>
      )}
      {!administers && <p>{t("administration:administration.administratorsOnly")}</p>}
    </Stack>
  );
}
