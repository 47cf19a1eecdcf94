import "./catalogue";
import { Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";
import { DataTable } from "../../ui/DataTable";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";
import { describeItem, describePrescription, differences, lower } from "./describeProgramme";
import { describeEndRangeTime } from "./EndRangeAdherence";

type Item = Schemas["ItemDone"];

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

function PlanTable({ items, ended }: { items: Item[]; ended: boolean }) {
  return (
    <div data-testid="planned">
      <DataTable
        name="session-plan"
        label={t("programmes:plan.title")}
        columns={[...PLAN_COLUMNS, differencesColumn(ended)]}
        rows={items}
        rowKey={({ position }) => String(position)}
        dense
      />
    </div>
  );
}

const PLAN_COLUMNS: Column<Item>[] = [
  {
    key: "number",
    onWide: true,
    head: t("programmes:plan.number"),
    value: ({ position }) => position,
    cell: ({ position }) => position,
  },
  {
    key: "recording",
    always: true,
    head: t("programmes:plan.recording"),
    value: ({ recording_name }) => recording_name,
    cell: ({ recording_name }) => recording_name,
  },
  {
    key: "repetitions",
    head: t("programmes:plan.repetitions"),
    value: ({ repetitions_done }) => repetitions_done,
    cell: (item) => (
      <>
        {t("programmes:plan.repeated", { done: item.repetitions_done, planned: item.repetitions })}
        {item.end_range && (
          <Text>
            {t("programmes:plan.endRange", {
              time: describeEndRangeTime(item.end_range_s ?? null, 60 * item.end_range.minutes),
            })}
          </Text>
        )}
      </>
    ),
  },
  {
    key: "planned",
    below: "recording",
    head: t("programmes:plan.planned"),
    value: describePrescription,
    cell: describePrescription,
  },
];

const differencesColumn = (ended: boolean): Column<Item> => ({
  key: "differences",
  head: t("programmes:plan.differences"),
  value: (item) => describeDifferences(item, ended),
  cell: (item) => describeDifferences(item, ended),
});

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
function describeDifferences(item: Item, ended: boolean): string {
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
