import { Group, Stack, Title } from "@mantine/core";
import { Link, Outlet } from "@tanstack/react-router";
import classes from "../../app/Shell.module.css";
import { useHasPermission } from "../auth/hooks";
import { ACCOUNTS, ADMINISTRATION, AUDIT, BACKUPS, EMERGENCIES } from "./messages";

const TABS = [
  { to: "/administration/accounts", label: ACCOUNTS.title },
  { to: "/administration/audit", label: AUDIT.title },
  { to: "/administration/emergency-access", label: EMERGENCIES.title },
  { to: "/administration/backups", label: BACKUPS.title },
] as const;

/** The administrator's pages: accounts, audit trail, emergency access and backups. */
export function AdministrationPage() {
  const administers = useHasPermission("administer");
  return (
    <Stack>
      <Title order={1} size="h2">
        {ADMINISTRATION.title}
      </Title>
      {administers && (
        <>
          <Group component="nav" gap={4} aria-label={ADMINISTRATION.parts}>
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
      {!administers && <p>{ADMINISTRATION.notForYou}</p>}
    </Stack>
  );
}
