import { Group, Progress, Stack, Text } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { formatDeg, formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";

/** Share of the torque from which the time counts (``STATED_SHARE`` in ``motion/end_feel.py``), percent. */
const STATED_PERCENT = 60;

/** Phase, torque and counted time of a stretch. */
export function StretchStatus({ stretch }: { stretch: Schemas["StretchLive"] }) {
  const torque = Math.max(0, stretch.torque_nm);
  const isBelow = stretch.phase === "hold" && torque < (STATED_PERCENT / 100) * stretch.target_nm;
  return (
    <Stack gap={4} role="group" aria-label={t("station:stretch.title")} data-testid="stretch">
      <Group justify="space-between">
        <Text size="lg" fw={600}>
          {t(`station:stretch.phases.${isBelow ? "holdBelow" : stretch.phase}`, {
            percent: STATED_PERCENT,
            left: formatDuration(Math.ceil(stretch.hold_left_s)),
          })}
        </Text>
        <Text size="lg" fw={600}>
          {t("station:stretch.torque", {
            torque: formatDeg(torque, 1),
            target: formatDeg(stretch.target_nm, 1),
          })}
        </Text>
      </Group>
      <Progress
        size={12}
        value={Math.min(100, (100 * torque) / stretch.target_nm)}
        aria-label={t("station:stretch.title")}
        transitionDuration={100}
      />
      <Text size="sm">
        {t("station:stretch.held", {
          time: formatDuration(Math.floor(stretch.held_s)),
          percent: STATED_PERCENT,
          left: stretch.repetitions_left,
        })}
      </Text>
    </Stack>
  );
}
