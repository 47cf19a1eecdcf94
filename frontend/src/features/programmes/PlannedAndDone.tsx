import { Stack, Table, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { describeItem, describePrescription, differences, lower } from "./describeProgramme";
import { describeEndRangeTime } from "./EndRangeAdherence";

/** Compares a session's programme with its runs. Renders nothing without a programme. */
export function PlannedAndDone({ sessionId }: { sessionId: string }) {
  const plan = useQuery({
    queryKey: ["session", sessionId, "plan"],
    queryFn: () => api.sessionPlan(sessionId),
  });
  if (plan.error) return <ProblemNote error={plan.error} />;
  if (!plan.data?.programme) return null;
  const { programme, items, besides, timer, ended } = plan.data;
  return (
    <Stack gap="xs" component="section" aria-label={t("programmes:plan.title")}>
      <Title order={2} size="h3">
        {t("programmes:plan.title")}
      </Title>
      <Text>
        <PageLink to="/programmes/$programmeId" params={{ programmeId: programme.id }}>
          {programme.name}
        </PageLink>
        {t("programmes:plan.summary", {
          version: programme.number,
          done: plan.data.repetitions_done,
          count: plan.data.repetitions_planned,
        })}
      </Text>
      {timer && (
        <Text data-testid="timer">
          {t(timer.left_s === 0 ? "programmes:plan.timeIsUp" : "programmes:plan.timer", {
            played: formatDuration(timer.played_s),
            count: timer.minutes,
          })}
        </Text>
      )}
      <PlanTable items={items} ended={ended} />
      {besides.length > 0 && <PlayedOutside runs={besides} />}
    </Stack>
  );
}

/** A telephone shows what was planned below the recording's name. */
function PlanTable({ items, ended }: { items: Schemas["ItemDone"][]; ended: boolean }) {
  return (
    <Table withTableBorder verticalSpacing="sm" data-testid="planned">
      <Table.Thead>
        <Table.Tr>
          <Table.Th w={40} visibleFrom="sm">
            {t("programmes:plan.number")}
          </Table.Th>
          <Table.Th>{t("programmes:plan.recording")}</Table.Th>
          <Table.Th>{t("programmes:plan.repetitions")}</Table.Th>
          <Table.Th visibleFrom="sm">{t("programmes:plan.planned")}</Table.Th>
          <Table.Th>{t("programmes:plan.differences")}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {items.map((item) => (
          <Table.Tr key={item.position}>
            <Table.Td visibleFrom="sm">{item.position}</Table.Td>
            <Table.Td>
              {item.recording_name}
              <Text size="sm" hiddenFrom="sm">
                {describePrescription(item)}
              </Text>
            </Table.Td>
            <Table.Td>
              {t("programmes:plan.repeated", { done: item.repetitions_done, planned: item.repetitions })}
              {item.end_range && (
                <Text>
                  {t("programmes:plan.endRange", {
                    time: describeEndRangeTime(item.end_range_s ?? null, 60 * item.end_range.minutes),
                  })}
                </Text>
              )}
            </Table.Td>
            <Table.Td visibleFrom="sm">{describePrescription(item)}</Table.Td>
            <Table.Td>{describeDifferences(item, ended)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}

/** Shows the runs that are not in the programme. */
function PlayedOutside({ runs }: { runs: Schemas["PlannedRun"][] }) {
  return (
    <Text data-testid="besides">
      {t("programmes:plan.notPlanned", {
        runs: runs
          .map((run) =>
            t("programmes:plan.notPlannedRun", {
              recording: run.recording_name,
              played: lower(describeItem(run)),
            }),
          )
          .join(t("common:format.separator")),
      })}
    </Text>
  );
}

/** Describe how an item's runs differ from the plan. */
function describeDifferences(item: Schemas["ItemDone"], ended: boolean): string {
  const words = item.runs.flatMap((run) =>
    [
      run.outcome === "completed" ? [] : t(`programmes:outcomes.${run.outcome}`),
      differences(item, run, run.changed),
      run.least_range_percent === null
        ? []
        : t("programmes:plan.rangeReduced", { percent: Math.round(run.least_range_percent) }),
    ].flat(),
  );
  if (item.done === "none")
    words.unshift(ended ? t("programmes:plan.notPlayed") : t("programmes:plan.notYet"));
  return words.length > 0 ? t("programmes:played.list", { words }) : "–";
}
