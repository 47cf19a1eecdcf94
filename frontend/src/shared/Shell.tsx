import { AppShell, Badge, Box, Group, Text } from "@mantine/core";
import { IconPlugConnected, IconPlugConnectedX } from "@tabler/icons-react";
import { Link, Outlet } from "@tanstack/react-router";
import { useAlive, useConnected, useHeardAt, useLive, useSavedRecords, useStation } from "../live/hooks";
import { EstopBadge } from "./EstopBadge";
import { formatClock } from "./format";
import { PageLink } from "./links";
import { modeWords } from "./modes";
import classes from "./Shell.module.css";
import { StopBanner } from "./StopBanner";
import { StopButton } from "./StopButton";

const HEADER = 124;
const PAGES = [
  { to: "/", label: "Station" },
  { to: "/patients", label: "Patients" },
  { to: "/sessions", label: "Sessions" },
] as const;

/** What stands on every page: where one is, what the apparatus does, and Stop. */
export function Shell() {
  useSavedRecords();
  return (
    // Above dialogs: nothing may lie over Stop.
    <AppShell header={{ height: HEADER }} padding={0} zIndex={400}>
      <AppShell.Header>
        <Group h="100%" px="md" justify="space-between" wrap="nowrap" gap="md">
          <Box>
            <Group gap="lg" mb={8}>
              <PageLink to="/" fw={700} fz={22} c="indigo.9" underline="never">
                Kata <span lang="ja">肩型</span>
              </PageLink>
              <Group component="nav" gap={4} aria-label="Pages">
                {PAGES.map((page) => (
                  <Link
                    key={page.to}
                    to={page.to}
                    className={classes.page ?? ""}
                    activeProps={{ className: classes.here ?? "", "aria-current": "page" }}
                    activeOptions={{ exact: page.to === "/", includeSearch: false }}
                  >
                    {page.label}
                  </Link>
                ))}
              </Group>
            </Group>
            <Group gap="sm">
              <EstopBadge />
              <ModeBadge />
              <ConnectionBadge />
            </Group>
          </Box>
          <StopButton />
        </Group>
      </AppShell.Header>
      <AppShell.Main>
        <div className={classes.banners ?? ""}>
          <StopBanner />
          <LostBanner />
        </div>
        <Box component="main" p="md" maw={1400} mx="auto">
          <Outlet />
        </Box>
      </AppShell.Main>
    </AppShell>
  );
}

function ModeBadge() {
  const alive = useAlive();
  const mode = useLive("mode");
  const stop = useLive("stop");
  const run = useLive("run");
  return (
    <Badge
      size="xl"
      radius="sm"
      variant="light"
      color={alive ? "indigo" : "gray"}
      tt="none"
      data-testid="mode"
    >
      {alive && mode ? modeWords({ mode, stop, run }) : "State unknown"}
    </Badge>
  );
}

function ConnectionBadge() {
  const connected = useConnected();
  const station = useStation();
  return (
    <Group gap={6} data-testid="connection" data-connected={connected} role="status">
      {connected ? <IconPlugConnected size={18} /> : <IconPlugConnectedX size={18} />}
      <Text size="sm">
        {connected ? `Live${station?.simulated ? ", simulated apparatus" : ""}` : "Connection lost"}
      </Text>
    </Group>
  );
}

function LostBanner() {
  const connected = useConnected();
  const device = useLive("device");
  const heardAt = useHeardAt();
  const alive = useAlive();
  if (alive) return null;
  if (connected) {
    return (
      <Text className={classes.lost ?? ""} role="alert" data-testid="lost">
        {device === "starting"
          ? "The apparatus' control program is starting."
          : "The apparatus' control program does not answer. It is started again by itself; nothing that moved goes on by itself."}
      </Text>
    );
  }
  return (
    <Text className={classes.lost ?? ""} role="alert" data-testid="lost">
      {heardAt === null
        ? "Connecting to the service …"
        : `Connection lost. No live data since ${formatClock(heardAt)}: what is greyed out is old. The Stop button may not reach the apparatus; use the emergency stop.`}
    </Text>
  );
}
