import { AppShell, Badge, Box, Group, Text } from "@mantine/core";
import { IconPlugConnected, IconPlugConnectedX } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { Brand } from "../app/Brand";
import classes from "../app/Shell.module.css";
import { Alarms } from "../features/alarms/Alarms";
import { t } from "../lib/i18n";
import { useAge, useAlive, useConnected, useHeardAt, useLive, useStation } from "../lib/live/hooks";
import { EstopBadge } from "./EstopBadge";
import { ModeSign } from "./ModeSign";
import { describeMode } from "./modes";
import { StopBanner } from "./StopBanner";
import { StopButton } from "./StopButton";

/**
 * The frame of every signed-in page and of the lock screen: a header with apparatus state and Stop, then alarms.
 * `fullPageStop`: a stop takes the place of the page's controls.
 */
export function AppFrame(props: { children: ReactNode; top?: ReactNode; fullPageStop?: boolean }) {
  const { children, top, fullPageStop = false } = props;
  return (
    // The header is above dialogs, because nothing may cover Stop.
    <AppShell header={{ height: "var(--kata-header)" }} padding={0} zIndex={400}>
      <AppShell.Header>
        <Group className={classes.header ?? ""} wrap="nowrap">
          <Box className={classes.beside ?? ""}>
            <Group wrap="nowrap" className={classes.top ?? ""}>
              {top ?? (
                <Text fw={700} fz={22} c="var(--kata-brand)">
                  <Brand />
                </Text>
              )}
            </Group>
            <Group className={classes.state ?? ""}>
              <StationName />
              <EstopBadge />
              <ModeBadge />
              <ConnectionBadge />
              <SimulatedMark />
            </Group>
          </Box>
          <StopButton />
        </Group>
      </AppShell.Header>
      <AppShell.Main>
        <div
          className={classes.banners ?? ""}
          data-full-page-stop={fullPageStop}
          data-screen-only
          ref={storeBannersHeight}
        >
          <StopBanner fullPage={fullPageStop} />
          <div className={classes.alarms ?? ""}>
            <Alarms />
          </div>
        </div>
        {children}
      </AppShell.Main>
    </AppShell>
  );
}

/** Store the height of the stop and alarms that stay visible. The patient banner stays visible below them. */
function storeBannersHeight(banners: HTMLDivElement | null) {
  const alarms = banners?.lastElementChild as HTMLElement | null | undefined;
  if (!banners || !alarms) return undefined;
  const observer = new ResizeObserver(() => {
    // Where only the alarms stay visible, the frame around both has no box, so its height is 0.
    const height = banners.offsetHeight || alarms.offsetHeight;
    document.documentElement.style.setProperty("--kata-banners", `${height}px`);
  });
  observer.observe(banners);
  observer.observe(alarms);
  return () => observer.disconnect();
}

/** Names the station whose state and Stop are beside it. */
function StationName() {
  const station = useStation();
  return (
    <Text fw={600} className={classes.stationName ?? ""} data-testid="station-name">
      {station?.name}
    </Text>
  );
}

function ModeBadge() {
  const alive = useAlive();
  const mode = useLive("mode");
  const stop = useLive("stop");
  const run = useLive("run");
  const torque = useLive("torque");
  return (
    <ModeSign torque={alive && mode ? torque : null} className={classes.mode ?? ""} testid="mode">
      {alive && mode ? describeMode({ mode, torque, stop, run }) : t("common:shell.modeUnknown")}
    </ModeSign>
  );
}

function ConnectionBadge() {
  const connected = useConnected();
  const received = useHeardAt() !== null;
  const starting = useLive("device") === "starting";
  const station = useStation();
  // Before the first message, a missing connection is not an alarm.
  const noConnection = received ? t("common:shell.lost") : t("common:shell.connecting");
  const connectedText = starting
    ? t("common:shell.starting")
    : station?.simulated
      ? t("common:shell.liveSimulated")
      : t("common:shell.live");
  return (
    <Group gap={6} wrap="nowrap" data-testid="connection" data-connected={connected}>
      {connected ? (
        <IconPlugConnected size={18} className={classes.connectedIcon} />
      ) : (
        <IconPlugConnectedX size={18} />
      )}
      <Text size="sm" role="status" className={classes.connectionWords ?? ""}>
        {connected ? connectedText : noConnection}
      </Text>
      <StateAge />
    </Group>
  );
}

/**
 * Says that the apparatus is simulated where the connection's words are not seen. A screen reader reads those, so it skips
 * this mark.
 */
function SimulatedMark() {
  const station = useStation();
  if (!station?.simulated) return null;
  return (
    <Badge
      className={classes.simulated ?? ""}
      variant="outline"
      color="grape"
      radius="sm"
      tt="none"
      aria-hidden
      data-testid="simulated-mark"
    >
      {t("common:simulatedShort")}
    </Badge>
  );
}

/** Shows the age of the state. Screen readers do not announce it, because it changes twice per second. */
function StateAge() {
  const age = useAge();
  if (age === null) return null;
  return (
    <Text size="sm" className={classes.age ?? ""} data-testid="age">
      {formatAge(age)}
    </Text>
  );
}

const formatAge = (tenths: number) =>
  tenths < 600
    ? t("common:shell.secondsOld", { seconds: (tenths / 10).toFixed(1) })
    : t("common:shell.minutesOld", { minutes: Math.floor(tenths / 600) });
