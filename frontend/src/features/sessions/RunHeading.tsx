import { Badge, Group, Text, Title } from "@mantine/core";
import type { Run } from "../../lib/api/client";
import { formatClock, formatDeg, formatList } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { InlineSlot } from "../../ui/InlineSlot";
import { PageLink } from "../../ui/links";
import { describeSettings } from "../station/playSettingsModel";
import { RESISTANCE_LEVELS } from "../station/resistanceLevels";

/** The recording, the time, the outcome and the settings of a playback. */
export function RunHeading({ run, number }: { run: Run; number: number }) {
  const level =
    run.resistance_level === null
      ? []
      : [t("sessions:session.level", { level: run.resistance_level, most: RESISTANCE_LEVELS })];
  const changes = describeSettings(run);
  return (
    <div>
      <Group justify="space-between">
        <Title order={2} size="h3">
          <InlineSlot words={(recording) => t("sessions:session.numbered", { number, recording })}>
            <PageLink inherit to="/recordings/$recordingId" params={{ recordingId: run.recording_id }}>
              {run.recording_name}
            </PageLink>
          </InlineSlot>
        </Title>
        <Group>
          <Text>{formatClock(new Date(run.started_at))}</Text>
          <Badge size="lg" variant="light" color={run.outcome === "completed" ? "indigo" : "grape"} tt="none">
            {t(`sessions:outcomes.${run.outcome}`)}
          </Badge>
        </Group>
      </Group>
      <Group gap="md">
        <Text c="dimmed">{formatList([...level, ...(changes ? [changes] : [])])}</Text>
        <Text data-testid="done">{describeCourse(run)}</Text>
      </Group>
      {(run.learning ?? []).map(({ message, message_key }) => (
        <Text key={message} data-testid="learning">
          {t("sessions:session.learning", { what: translateServerText(message, message_key) })}
        </Text>
      ))}
    </div>
  );
}

/** Return in words how much was played and what interrupted it. */
function describeCourse(run: Run): string {
  const words: string[] = [];
  if (run.end_feel) return t(`sessions:session.endFeel.${run.end_feel}`);
  if (run.repetitions_done !== null) {
    words.push(t("sessions:session.repetitions", { done: run.repetitions_done, count: run.repetitions }));
  }
  if (run.reversals) words.push(t("sessions:session.reversals", { count: run.reversals }));
  if (run.least_range_percent !== null)
    words.push(t("sessions:session.smallestRange", { percent: run.least_range_percent }));
  if (run.self_paced && typeof run.work_j === "number")
    words.push(
      t("sessions:session.selfPaced", {
        effort: formatDeg(run.mean_effort_nm ?? null, 1),
        work: formatDeg(run.work_j, 1),
      }),
    );
  if (typeof run.mean_pace_percent === "number")
    words.push(t("sessions:session.meanPace", { percent: Math.round(run.mean_pace_percent) }));
  if (typeof run.compared_percent === "number")
    words.push(t("sessions:compared.share", { percent: Math.floor(run.compared_percent) }));
  return formatList(words);
}

/** Return why a playback has no errors. */
export function describeMissingComparison(run: Pick<Run, "outcome" | "compared_percent">): string {
  if (run.outcome === "loaded") return t("sessions:session.notYetCompared");
  return run.compared_percent === 0
    ? t("sessions:session.onlyReduced")
    : t("sessions:session.nothingToCompare");
}
