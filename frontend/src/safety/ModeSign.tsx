import { Badge } from "@mantine/core";
import { IconBoltFilled, IconBoltOff, IconHelpHexagon } from "@tabler/icons-react";
import type { Live } from "../lib/api/client";
import classes from "./ModeSign.module.css";

const ICONS = { on: IconBoltFilled, off: IconBoltOff, unknown: IconHelpHexagon };

/**
 * The state of a station in words. Torque on, off and unknown differ in words, icon, fill and edge. Null: the page gets
 * no data, so the torque is unknown.
 */
export function ModeSign(props: {
  torque: Live["torque"] | null;
  className?: string;
  testid?: string;
  children: string;
}) {
  const torque = props.torque ?? "unknown";
  const Icon = ICONS[torque];
  return (
    <Badge
      size="xl"
      radius="sm"
      variant="default"
      tt="none"
      className={`${classes.sign} ${props.className ?? ""}`}
      data-testid={props.testid}
      data-torque={torque}
    >
      <Icon size={18} className={classes.icon} aria-hidden />
      {props.children}
    </Badge>
  );
}
