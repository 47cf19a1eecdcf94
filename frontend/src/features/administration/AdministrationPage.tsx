import { Group, Stack, Title } from "@mantine/core";
import { Link, Outlet } from "@tanstack/react-router";
import classes from "../../app/Shell.module.css";
import { useMay } from "../auth/hooks";
import { ACCOUNTS, ADMINISTRATION, AUDIT, BACKUPS, EMERGENCIES } from "./messages";

const PARTS = [
  { to: "/administration/accounts", label: ACCOUNTS.title },
  { to: "/administration/audit", label: AUDIT.title },
  { to: "/administration/emergency-access", label: EMERGENCIES.title },
  { to: "/administration/backups", label: BACKUPS.title },
] as const;

/** What an administrator looks after: who may come in, what was done, and that nothing gets lost. */
export function AdministrationPage() {
  const administers = useMay("administer");
  return (
    <Stack>
      <Title order={1} size="h2">
        {ADMINISTRATION.title}
      </Title>
      {administers && (
        <>
          <Group component="nav" gap={4} aria-label={ADMINISTRATION.parts}>
            {PARTS.map(({ to, label }) => (
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
