import { AppShell, Badge, Box, Group, Text } from "@mantine/core";
import { IconPlugConnected, IconPlugConnectedX } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { useAlive, useConnected, useHeardAt, useLive, useStation } from "../live/hooks";
import { EstopBadge } from "./EstopBadge";
import { formatClock } from "./format";
import { KeptBanner } from "./KeptBanner";
import { modeWords } from "./modes";
import classes from "./Shell.module.css";
import { StopBanner } from "./StopBanner";
import { StopButton } from "./StopButton";

const HEADER = 124;

/** What stands above everything while somebody is signed in, behind a locked screen too: what the apparatus does, and Stop. */
export function StateBar({ children, top }: { children: ReactNode; top?: ReactNode }) {
  return (
    // Above dialogs: nothing may lie over Stop.
    <AppShell header={{ height: HEADER }} padding={0} zIndex={400}>
      <AppShell.Header>
        <Group h="100%" px="md" justify="space-between" wrap="nowrap" gap="md">
          <Box flex={1} miw={0}>
            <Group gap="lg" mb={8} wrap="nowrap">
              {top ?? (
                <Text fw={700} fz={22} c="indigo.9">
                  Kata <span lang="ja">肩型</span>
                </Text>
              )}
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
          <KeptBanner />
        </div>
        {children}
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
