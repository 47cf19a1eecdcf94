import { Checkbox, Group, Progress, Stack, Text } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";
import type { Settings } from "./playSettingsModel";

/**
 * The choice that the patient's effort sets the pace. Without the doctor's permission it is not shown, and a note says so
 * if a programme prescribes it.
 */
export function SelfPacedChoice(props: {
  permitted: boolean;
  /** True if the programme prescribes it. */
  prescribed?: boolean | undefined;
  method: Settings["method"];
  value: boolean;
  onChange: (value: boolean) => void;
}) {
  if (!props.permitted)
    return props.prescribed ? <Text role="note">{t("station:selfPaced.notPermitted")}</Text> : null;
  const smooth = props.method === "smooth";
  return (
    <Checkbox
      size="lg"
      label={t("station:selfPaced.choice")}
      description={t(smooth ? "station:selfPaced.explanation" : "station:selfPaced.onlySmooth")}
      disabled={!smooth}
      checked={smooth && props.value}
      onChange={(event) => props.onChange(event.currentTarget.checked)}
    />
  );
}

/** Pace, effort and work of a self-paced playback. */
export function SelfPacedStatus({ pacing }: { pacing: Schemas["SelfPacingLive"] }) {
  // A recording begins with a rest. The apparatus passes it with a pace of 100 %, without an effort that it could compare.
  if (pacing.threshold_nm === 0) return <Text>{t("station:selfPaced.notBegun")}</Text>;
  return (
    <Stack gap={4} role="group" aria-label={t("station:selfPaced.title")} data-testid="self-paced">
      <Group justify="space-between">
        <Text size="lg" fw={600}>
          {t("station:selfPaced.pace", { percent: Math.round(pacing.pace_percent) })}
        </Text>
        <Text size="lg" fw={600}>
          {t("station:selfPaced.effort", { effort: formatDeg(pacing.effort_nm, 1) })}
        </Text>
      </Group>
      <Progress
        size={12}
        value={pacing.pace_percent}
        aria-label={t("station:selfPaced.title")}
        transitionDuration={100}
      />
      <Text size="sm">
        {t("station:selfPaced.work", {
          work: formatDeg(pacing.work_j, 1),
          threshold: formatDeg(pacing.threshold_nm, 1),
        })}
      </Text>
    </Stack>
  );
}
