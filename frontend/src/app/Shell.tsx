import { Box, Group } from "@mantine/core";
import { Link, Outlet, useRouterState } from "@tanstack/react-router";
import { AccountMenu } from "../features/auth/AccountMenu";
import { useMay } from "../features/auth/hooks";
import { useSavedRecords } from "../lib/live/hooks";
import { SHELL } from "../lib/messages";
import { useBackAgain } from "../lib/offline";
import { StateBar } from "../safety/StateBar";
import { PageLink } from "../ui/links";
import { Brand } from "./Brand";
import classes from "./Shell.module.css";

const PAGES = [
  { to: "/", label: SHELL.station, needs: "see_station" },
  { to: "/stations", label: SHELL.stations, needs: "see_station" },
  { to: "/patients", label: SHELL.patients, needs: "read_records" },
  { to: "/sessions", label: SHELL.sessions, needs: "read_records" },
  { to: "/administration", label: SHELL.administration, needs: "administer" },
] as const;

/** What stands on every page: where one is, who one is, what the apparatus does, and Stop. */
export function Shell() {
  useSavedRecords();
  useBackAgain();
  // The page that stands there: the address is already the next one's while that is being fetched.
  const page = useRouterState({ select: (state) => state.matches.at(-1)?.routeId });
  return (
    // On the station's own screen a stop stands in place of the work.
    <StateBar top={<Top />} stopBanner={page !== "/"}>
      <Box p="md" maw={1400} mx="auto">
        <Outlet />
      </Box>
    </StateBar>
  );
}

function Top() {
  return (
    <>
      <PageLink
        to="/"
        fw={700}
        fz={22}
        c="var(--kata-brand)"
        underline="never"
        style={{ whiteSpace: "nowrap" }}
      >
        <Brand />
      </PageLink>
      <Group component="nav" gap={4} wrap="nowrap" aria-label={SHELL.pages}>
        {PAGES.map((page) => (
          <Tab key={page.to} {...page} />
        ))}
      </Group>
      <AccountMenu />
    </>
  );
}

function Tab({ to, label, needs }: (typeof PAGES)[number]) {
  if (!useMay(needs)) return null;
  return (
    <Link
      to={to}
      className={classes.page ?? ""}
      activeProps={{ className: classes.here ?? "", "aria-current": "page" }}
      activeOptions={{ exact: to === "/", includeSearch: false }}
    >
      {label}
    </Link>
  );
}
