import { Button, Group, Text } from "@mantine/core";
import {
  IconAlertOctagonFilled,
  IconAlertTriangleFilled,
  IconInfoSquareFilled,
  IconVolume,
  IconVolumeOff,
} from "@tabler/icons-react";
import { type ReactNode, useEffect, useState, useSyncExternalStore } from "react";
import { store } from "../../lib/live/store";
import { type Alarm, alarmsOf, type Priority } from "./alarms";
import classes from "./alarms.module.css";
import { PRIORITY_WORDS, WORDS } from "./messages";
import { Pausing, Sounder } from "./sound";

const ICONS = { high: IconAlertOctagonFilled, medium: IconAlertTriangleFilled, low: IconInfoSquareFilled };
const LOOK_EVERY_MS = 500;

/** What holds now; the same list until another alarm holds. */
export function useAlarms(): Alarm[] {
  const told = useSyncExternalStore(store.subscribe, () => JSON.stringify(alarmsOf(store.get())));
  return JSON.parse(told) as Alarm[];
}

/** Colour, icon and words of one priority around what there is to say. */
export function AlarmFrame(props: { priority: Priority; testid?: string; children: ReactNode }) {
  const Icon = ICONS[props.priority];
  return (
    <div className={classes.alarm} data-priority={props.priority} data-testid={props.testid} role="alert">
      <div className={classes.mark}>
        <Icon size={40} role="img" aria-label={PRIORITY_WORDS[props.priority]} />
      </div>
      <div className={classes.told}>{props.children}</div>
    </div>
  );
}

/** Every alarm but a stop, which has a banner of its own, and the button that pauses the sound of all of them. */
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
      <Sound alarms={alarms} />
    </>
  );
}

function Sound({ alarms }: { alarms: Alarm[] }) {
  const [sounder] = useState(() => new Sounder());
  const [pausing] = useState(() => new Pausing());
  const [now, setNow] = useState(() => Date.now());
  const heard = pausing.heard(alarms, now);
  useEffect(() => {
    for (const act of ["pointerdown", "keydown"]) window.addEventListener(act, sounder.allow, true);
    const looking = setInterval(() => setNow(Date.now()), LOOK_EVERY_MS);
    return () => {
      for (const act of ["pointerdown", "keydown"]) window.removeEventListener(act, sounder.allow, true);
      clearInterval(looking);
      sounder.sound(null);
    };
  }, [sounder]);
  useEffect(() => sounder.sound(heard), [sounder, heard]);
  if (alarms.length === 0) return null;
  return (
    <Group
      gap="md"
      px="md"
      py={6}
      className={classes.sound ?? ""}
      data-testid="alarm-sound"
      data-sounding={heard !== null}
    >
      <Button
        variant="default"
        leftSection={heard ? <IconVolumeOff size={22} /> : <IconVolume size={22} />}
        onClick={() => {
          if (heard) pausing.pause(alarms, Date.now());
          else pausing.resume();
          setNow(Date.now());
        }}
      >
        {heard ? WORDS.pauseSound : WORDS.soundOn}
      </Button>
      <Text size="sm" role="status">
        {pausing.paused ? WORDS.soundPaused : sounder.allowed ? "" : WORDS.noSound}
      </Text>
    </Group>
  );
}
