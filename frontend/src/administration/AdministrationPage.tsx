import { Group, Stack, Title } from "@mantine/core";
import { Link, Outlet } from "@tanstack/react-router";
import { useMay } from "../access/hooks";
import classes from "../shared/Shell.module.css";

const PARTS = [
  { to: "/administration/accounts", label: "Accounts" },
  { to: "/administration/audit", label: "Audit trail" },
  { to: "/administration/emergency-access", label: "Emergency access" },
  { to: "/administration/backups", label: "Backups" },
] as const;

/** What an administrator looks after: who may come in, what was done, and that nothing gets lost. */
export function AdministrationPage() {
  const administers = useMay("administer");
  return (
    <Stack>
      <Title order={1} size="h2">
        Administration
      </Title>
      {administers && (
        <>
          <Group component="nav" gap={4} aria-label="Parts of the administration">
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
      {!administers && <p>This is for administrators.</p>}
    </Stack>
  );
}
