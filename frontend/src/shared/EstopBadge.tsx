import { Badge } from "@mantine/core";
import {
  IconAlertOctagonFilled,
  IconCircleCheck,
  IconHelpHexagon,
  IconLockExclamation,
} from "@tabler/icons-react";
import type { Live } from "../api/client";
import { useAlive, useLive } from "../live/hooks";

const LOOKS = {
  closed: { text: "E-stop ready", color: "gray", variant: "outline", Icon: IconCircleCheck },
  pressed: { text: "E-stop pressed", color: "red.8", variant: "filled", Icon: IconAlertOctagonFilled },
  released: {
    text: "E-stop released, not acknowledged",
    color: "yellow.4",
    variant: "filled",
    Icon: IconLockExclamation,
  },
  unknown: { text: "E-stop unknown", color: "red.8", variant: "outline", Icon: IconHelpHexagon },
} as const;

/** This station's emergency stop, each of the four different in words, icon, colour and fill. */
export function EstopBadge() {
  const alive = useAlive();
  const told = useLive("estop");
  return <EstopSign estop={alive && told ? told : "unknown"} />;
}

/** Of whichever station. */
export function EstopSign({ estop }: { estop: Live["estop"] }) {
  const { text, color, variant, Icon } = LOOKS[estop];
  return (
    <Badge
      size="xl"
      radius="sm"
      color={color}
      variant={variant}
      autoContrast
      leftSection={<Icon size={20} />}
      tt="none"
      data-testid="estop"
      data-state={estop}
      role="status"
    >
      {text}
    </Badge>
  );
}
