import { Group, Progress, Stack, Text } from "@mantine/core";
import type { Schemas, Session } from "../../lib/api/client";
import { countedSeconds, formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useNewestSession } from "../../lib/patientQueries";
import { translateServerText } from "../../lib/serverText";

/**
 * The end-range time of this session so far against the prescribed one: the stored times of its earlier playbacks
 * and the live time of this one.
 */
export function EndRangeCounter({ run }: { run: Schemas["RunLive"] }) {
  const session = useNewestSession(run.patient?.id ?? null);
  const live = run.end_range;
  if (!live) return null;
  const motion = translateServerText(live.name, live.name_key);
  if (live.counted_s === null)
    return <Text data-testid="end-range">{t("station:endRange.notCounted", { motion })}</Text>;
  const total_s = storedEndRangeS(session.data ?? null, run, live.motion) + live.counted_s;
  return (
    <Stack gap={4} role="group" aria-label={t("station:endRange.title")} data-testid="end-range">
      <Group justify="space-between">
        <Text size="lg">{t("station:endRange.motion", { motion })}</Text>
        <Text size="lg" fw={600}>
          {t("station:endRange.of", {
            time: formatDuration(countedSeconds(total_s)),
            goal: formatDuration(live.prescribed_s),
          })}
        </Text>
      </Group>
      <Progress
        size={12}
        value={Math.min(100, (100 * total_s) / live.prescribed_s)}
        aria-label={t("station:endRange.title")}
        transitionDuration={100}
      />
      <Text size="sm">{t("station:endRange.live", { band: live.band_deg, torque: live.torque_nm })}</Text>
      {live.problem && (
        <Text fw={600} data-testid="end-range-problem">
          {t("station:endRange.notReached", { reason: translateServerText(live.problem, live.problem_key) })}
        </Text>
      )}
    </Stack>
  );
}

/**
 * Return the stored seconds of a motion in the session's earlier playbacks, of the items that prescribe it. The
 * session must be the one that is played.
 */
export function storedEndRangeS(
  session: Session | null,
  run: Pick<Schemas["RunLive"], "run_id" | "session_id">,
  motion: number,
): number {
  if (!session || session.id !== run.session_id) return 0;
  const positions = (session.programme?.items ?? [])
    .filter(({ end_range }) => end_range?.motion === motion)
    .map(({ position }) => position);
  return session.runs
    .filter(({ id, programme_position }) => id !== run.run_id && positions.includes(programme_position ?? 0))
    .flatMap(({ comparison }) => comparison?.motions ?? [])
    .reduce((sum, one) => sum + (one.motion === motion ? (one.end_range_s ?? 0) : 0), 0);
}
