import { Stack, Table, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { formatSpan } from "../../lib/format";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { differences, itemWords } from "./describeProgramme";
import { PLAYED } from "./messages";
import { OUTCOMES, PLAN } from "./planMessages";

/** Compares a session's programme with its runs. Empty without a programme. */
export function PlannedAndDone({ sessionId }: { sessionId: string }) {
  const plan = useQuery({
    queryKey: ["session", sessionId, "plan"],
    queryFn: () => api.sessionPlan(sessionId),
  });
  if (plan.error) return <ProblemNote error={plan.error} />;
  if (!plan.data?.programme) return null;
  const { programme, items, besides, timer, ended } = plan.data;
  return (
    <Stack gap="xs" component="section" aria-label={PLAN.title}>
      <Title order={2} size="h3">
        {PLAN.title}
      </Title>
      <Text>
        <PageLink to="/programmes/$programmeId" params={{ programmeId: programme.id }}>
          {programme.name}
        </PageLink>
        {PLAN.of(programme.number, plan.data.repetitions_done, plan.data.repetitions_planned)}
      </Text>
      {timer && (
        <Text data-testid="timer">
          {(timer.left_s === 0 ? PLAN.timeIsUp : PLAN.timer)(formatSpan(timer.played_s), timer.minutes)}
        </Text>
      )}
      <Table withTableBorder verticalSpacing="sm" data-testid="planned">
        <Table.Thead>
          <Table.Tr>
            <Table.Th w={40}>{PLAN.number}</Table.Th>
            <Table.Th>{PLAN.recording}</Table.Th>
            <Table.Th>{PLAN.planned}</Table.Th>
            <Table.Th ta="right">{PLAN.repetitions}</Table.Th>
            <Table.Th>{PLAN.otherwise}</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {items.map((item) => (
            <Table.Tr key={item.position}>
              <Table.Td>{item.position}</Table.Td>
              <Table.Td>{item.recording_name}</Table.Td>
              <Table.Td>{itemWords(item)}</Table.Td>
              <Table.Td ta="right">{PLAN.repeated(item.repetitions_done, item.repetitions)}</Table.Td>
              <Table.Td>{otherwise(item, ended)}</Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
      {besides.length > 0 && (
        <Text data-testid="besides">
          {PLAN.besides(besides.map((run) => ({ recording: run.recording_name, played: itemWords(run) })))}
        </Text>
      )}
    </Stack>
  );
}

function otherwise(item: Schemas["ItemDone"], ended: boolean): string {
  const words = item.runs.flatMap((run) =>
    [
      OUTCOMES[run.outcome] ?? [],
      differences(item, run, run.changed),
      run.least_range_percent === null ? [] : PLAN.lessRange(Math.round(run.least_range_percent)),
    ].flat(),
  );
  if (item.done === "none") words.unshift(ended ? PLAN.leftOut : PLAN.notYet);
  return words.length > 0 ? PLAYED.several(words) : "–";
}
