import { Button, Group, Text } from "@mantine/core";
import {
  IconAlertOctagonFilled,
  IconAlertTriangleFilled,
  IconInfoSquareFilled,
  IconVolume,
  IconVolumeOff,
} from "@tabler/icons-react";
import { type ReactNode, type Ref, useEffect, useState, useSyncExternalStore } from "react";
import { t } from "../../lib/i18n";
import { store } from "../../lib/live/store";
import { type Alarm, activeAlarms, type Priority } from "./alarms";
import classes from "./alarms.module.css";
import { AlarmSounder, SoundPause } from "./sound";

const ICONS = { high: IconAlertOctagonFilled, medium: IconAlertTriangleFilled, low: IconInfoSquareFilled };
const CHECK_EVERY_MS = 500;

/** Return the active alarms. The returned list stays the same object until an alarm changes. */
export function useAlarms(): Alarm[] {
  const serialized = useSyncExternalStore(store.subscribe, () => JSON.stringify(activeAlarms(store.get())));
  return JSON.parse(serialized) as Alarm[];
}

/** Shows the colour, icon and label of a priority around its content. */
export function AlarmFrame(props: {
  priority: Priority;
  testid?: string;
  ref?: Ref<HTMLDivElement>;
  children: ReactNode;
}) {
  const { priority, testid, ref } = props;
  const Icon = ICONS[priority];
  return (
    <div className={classes.alarm} data-priority={priority} data-testid={testid} role="alert" ref={ref}>
      <div className={classes.mark}>
        <Icon size={40} role="img" aria-label={t(`alarms:priorities.${priority}`)} />
      </div>
      <div className={classes.content}>{props.children}</div>
    </div>
  );
}

/** Shows all alarms except stops, which StopBanner shows, and the button that pauses the sound. */
export function Alarms() {
  const alarms = useAlarms();
  return (
    <>
      {alarms
        .filter((alarm) => !alarm.code.startsWith("stop "))
        .map((alarm) => (
          <AlarmFrame
            key={alarm.code}
            priority={alarm.priority}
            testid={alarm.code === "connection_lost" || alarm.code === "device_silent" ? "lost" : "alarm"}
          >
            <Text size="lg" fw={700}>
              {alarm.message}
            </Text>
            <Text>{alarm.nextStep}</Text>
          </AlarmFrame>
        ))}
      <AlarmSound alarms={alarms} />
    </>
  );
}

function AlarmSound({ alarms }: { alarms: Alarm[] }) {
  const [sounder] = useState(() => new AlarmSounder());
  const [pause] = useState(() => new SoundPause());
  const [now, setNow] = useState(() => Date.now());
  const sounding = pause.audible(alarms, now);
  useEffect(() => {
    for (const event of ["pointerdown", "keydown"]) window.addEventListener(event, sounder.unlockAudio, true);
    const timer = setInterval(() => setNow(Date.now()), CHECK_EVERY_MS);
    return () => {
      for (const event of ["pointerdown", "keydown"])
        window.removeEventListener(event, sounder.unlockAudio, true);
      clearInterval(timer);
      sounder.sound(null);
    };
  }, [sounder]);
  useEffect(() => sounder.sound(sounding), [sounder, sounding]);
  if (alarms.length === 0) return null;
  return (
    <Group
      gap="md"
      px="md"
      py={6}
      className={classes.sound ?? ""}
      data-testid="alarm-sound"
      data-sounding={sounding !== null}
    >
      <Button
        variant="default"
        leftSection={sounding ? <IconVolumeOff size={22} /> : <IconVolume size={22} />}
        onClick={() => {
          if (sounding) pause.pause(alarms, Date.now());
          else pause.resume();
          setNow(Date.now());
        }}
      >
        {sounding ? t("alarms:texts.pauseSound") : t("alarms:texts.soundOn")}
      </Button>
      <Text size="sm" role="status">
        {pause.paused ? t("alarms:texts.soundPaused") : sounder.isUnlocked ? "" : t("alarms:texts.noSound")}
      </Text>
    </Group>
  );
}
