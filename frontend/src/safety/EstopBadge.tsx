import {
  IconAlertOctagonFilled,
  IconCircleCheck,
  IconHelpHexagon,
  IconLockExclamation,
  IconPlugConnectedX,
} from "@tabler/icons-react";
import classes from "../features/alarms/alarms.module.css";
import type { Live } from "../lib/api/client";
import { t } from "../lib/i18n";
import { useAlive, useLive } from "../lib/live/hooks";

const STATES = {
  closed: { text: t("common:estop.closed"), Icon: IconCircleCheck },
  pressed: { text: t("common:estop.pressed"), Icon: IconAlertOctagonFilled },
  released: { text: t("common:estop.released"), Icon: IconLockExclamation },
  missing: { text: t("common:estop.missing"), Icon: IconPlugConnectedX },
  unknown: { text: t("common:estop.unknown"), Icon: IconHelpHexagon },
} as const;

type EstopState = keyof typeof STATES;

/**
 * Return the badge's state: "missing" if the apparatus gets no signal from the switch, and "unknown" if the
 * page gets no data.
 */
export function estopState(alive: boolean, estop: Live["estop"] | null): EstopState {
  if (!alive || estop === null) return "unknown";
  return estop === "unknown" ? "missing" : estop;
}

/** This station's emergency stop. The five states differ in text, icon, colour and border. */
export function EstopBadge() {
  return <EstopSign estop={estopState(useAlive(), useLive("estop"))} />;
}

/** The badge for any station's emergency stop. */
export function EstopSign({ estop: state }: { estop: EstopState }) {
  const { text, Icon } = STATES[state];
  return (
    <span className={classes.estop} data-testid="estop" data-state={state} role="status">
      <Icon size={20} aria-hidden />
      {text}
    </span>
  );
}
