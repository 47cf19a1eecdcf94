import {
  IconAlertOctagonFilled,
  IconCircleCheck,
  IconHelpHexagon,
  IconLockExclamation,
  IconPlugConnectedX,
} from "@tabler/icons-react";
import classes from "../features/alarms/alarms.module.css";
import type { Live } from "../lib/api/client";
import { useAlive, useLive } from "../lib/live/hooks";
import { ESTOP } from "../lib/messages";

const LOOKS = {
  closed: { text: ESTOP.closed, Icon: IconCircleCheck },
  pressed: { text: ESTOP.pressed, Icon: IconAlertOctagonFilled },
  released: { text: ESTOP.released, Icon: IconLockExclamation },
  missing: { text: ESTOP.missing, Icon: IconPlugConnectedX },
  unknown: { text: ESTOP.unknown, Icon: IconHelpHexagon },
} as const;

type Look = keyof typeof LOOKS;

/** Of the five: a switch that the apparatus does not hear is missing; what nobody tells us of is unknown. */
export function estopLook(alive: boolean, told: Live["estop"] | null): Look {
  if (!alive || told === null) return "unknown";
  return told === "unknown" ? "missing" : told;
}

/** This station's emergency stop, each of the five different in words, icon, colour and edge. */
export function EstopBadge() {
  return <EstopSign estop={estopLook(useAlive(), useLive("estop"))} />;
}

/** Of whichever station. */
export function EstopSign({ estop: look }: { estop: Look }) {
  const { text, Icon } = LOOKS[look];
  return (
    <span className={classes.estop} data-testid="estop" data-state={look} role="status">
      <Icon size={20} aria-hidden />
      {text}
    </span>
  );
}
