import { Card, Group, Stack, Text, Title } from "@mantine/core";
import { lazy } from "react";
import type { Live } from "../../lib/api/client";
import { formatDegrees } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useAlive, useLive, useStation } from "../../lib/live/hooks";
import { LOST_AFTER_MS } from "../../lib/live/store";
import { LazyPart } from "../../ui/LazyPart";
import classes from "./station.module.css";

// Loaded separately, so that the chart library does not delay the numbers.
const AxisSparkline = lazy(() =>
  import("./AxisSparkline").then((module) => ({ default: module.AxisSparkline })),
);

const LINE = "━";
const MOTIONS = [
  { motor: 1, motion: t("station:angles.scapula") },
  { motor: 2, motion: t("station:angles.scapula") },
  { motor: 3, motion: t("station:angles.abduction") },
  { motor: 4, motion: t("station:angles.flexion") },
  { motor: 5, motion: t("station:angles.rotation") },
];

/** The five motor angles with their setpoints and ranges. */
export function Angles() {
  const alive = useAlive();
  const torque = useLive("torque");
  return (
    <Card withBorder padding="sm" component="section" aria-label={t("station:angles.title")}>
      <Group justify="space-between" mb={4}>
        <Title order={2} size="h4">
          {t("station:angles.title")}
        </Title>
        <Group gap="md">
          <Text size="sm">
            <Text span c="var(--kata-setpoint)" fw={700}>
              {LINE}
            </Text>{" "}
            {t("station:angles.setpoint")}{" "}
            <Text span c="var(--kata-measured)" fw={700}>
              {LINE}
            </Text>{" "}
            {t("station:angles.measured")}
          </Text>
          <Text fw={600} data-testid="torque">
            {describeTorque(alive ? torque : null)}
          </Text>
        </Group>
      </Group>
      <Stack gap={4} className={alive ? "" : "stale"} data-testid="angles" data-alive={alive}>
        {MOTIONS.map(({ motor, motion }) => (
          <Axis key={motor} axis={motor - 1} motion={motion} />
        ))}
      </Stack>
    </Card>
  );
}

function describeTorque(torque: Live["torque"] | null): string {
  return torque === "on"
    ? t("station:angles.torqueOn")
    : torque === "off"
      ? t("station:angles.torqueOff")
      : t("station:angles.torqueUnknown");
}

function Axis({ axis, motion }: { axis: number; motion: string }) {
  const station = useStation();
  const alive = useAlive();
  const now = useLive("axes")?.[axis];
  const info = station?.axes[axis];
  if (!info) return null;
  const place = (angle: number) =>
    `${Math.min(100, Math.max(0, (100 * (angle - info.min_deg)) / (info.max_deg - info.min_deg)))}%`;
  const measured = now?.measured_deg ?? null;
  const setpoint = now?.setpoint_deg ?? null;
  const torque = alive ? (now?.torque ?? null) : null;
  // The service lives, but this drive has not answered.
  const silent = now?.age_ms == null || now.age_ms >= LOST_AFTER_MS;
  return (
    <div className={silent ? `${classes.axis} stale` : classes.axis} data-testid={`axis-${axis + 1}`}>
      <div className={classes.name}>
        <Text component="div" fw={600} size="sm" style={{ whiteSpace: "nowrap" }}>
          {t("station:angles.motor", { motor: axis + 1 })}
        </Text>
        <Text component="div" size="xs" c="dimmed" truncate>
          {motion}
        </Text>
        <Text
          component="div"
          fz={22}
          fw={700}
          className={classes.number ?? ""}
          data-testid={`angle-${axis + 1}`}
        >
          {formatDegrees(measured)}
        </Text>
      </div>
      <LazyPart loading={<div className={classes.strip} />}>
        <AxisSparkline axis={axis} min={info.min_deg} max={info.max_deg} />
      </LazyPart>
      <div className={classes.scale}>
        <Text size="xs" c="dimmed">
          {formatDegrees(info.min_deg, 0)}
        </Text>
        <div className={classes.range} aria-hidden>
          {setpoint !== null && <div className={classes.setpoint} style={{ left: place(setpoint) }} />}
          {measured !== null && <div className={classes.measured} style={{ left: place(measured) }} />}
        </div>
        <Text size="xs" c="dimmed">
          {formatDegrees(info.max_deg, 0)}
        </Text>
        <Text size="xs" style={{ whiteSpace: "nowrap" }} data-testid={`torque-${axis + 1}`}>
          {describeTorque(torque)}
        </Text>
      </div>
    </div>
  );
}
