import { Stack, Table, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../api/client";
import { formatSpan } from "../shared/format";
import { PageLink } from "../shared/links";
import { ProblemNote } from "../shared/problem";
import { count, differences, itemWords, lower } from "./words";

/** What a session's programme asked for, and what was done of it; nothing where there was no programme. */
export function PlannedAndDone({ sessionId }: { sessionId: string }) {
  const plan = useQuery({
    queryKey: ["session", sessionId, "plan"],
    queryFn: () => api.sessionPlan(sessionId),
  });
  if (plan.error) return <ProblemNote error={plan.error} />;
  if (!plan.data?.programme) return null;
  const { programme, items, besides, timer, ended } = plan.data;
  return (
    <Stack gap="xs" component="section" aria-label="Planned and done">
      <Title order={2} size="h3">
        Planned and done
      </Title>
      <Text>
        <PageLink to="/programmes/$programmeId" params={{ programmeId: programme.id }}>
          {programme.name}
        </PageLink>
        , version {programme.number}: {plan.data.repetitions_done} of {plan.data.repetitions_planned} planned
        repetitions
      </Text>
      {timer && (
        <Text data-testid="timer">
          {formatSpan(timer.played_s)} of {count(timer.minutes, "minute")} played
          {timer.left_s === 0 && ": the time is up, no further recording is to be begun"}
        </Text>
      )}
      <Table withTableBorder verticalSpacing="sm" data-testid="planned">
        <Table.Thead>
          <Table.Tr>
            <Table.Th w={40}>No.</Table.Th>
            <Table.Th>Recording</Table.Th>
            <Table.Th>Planned</Table.Th>
            <Table.Th ta="right">Repetitions done</Table.Th>
            <Table.Th>What was otherwise</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {items.map((item) => (
            <Table.Tr key={item.position}>
              <Table.Td>{item.position}</Table.Td>
              <Table.Td>{item.recording_name}</Table.Td>
              <Table.Td>{itemWords(item)}</Table.Td>
              <Table.Td ta="right">
                {item.repetitions_done} of {item.repetitions}
              </Table.Td>
              <Table.Td>{otherwise(item, ended)}</Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
      {besides.length > 0 && (
        <Text data-testid="besides">
          Played besides:{" "}
          {besides.map((run) => `${run.recording_name} (${lower(itemWords(run))})`).join("; ")}.
        </Text>
      )}
    </Stack>
  );
}

const OUTCOMES: Partial<Record<Schemas["PlannedRun"]["outcome"], string[]>> = {
  loaded: ["goes on"],
  returned: ["ended early"],
  stopped: ["stopped"],
  unloaded: ["loaded, not played"],
  interrupted: ["interrupted"],
};

function otherwise(item: Schemas["ItemDone"], ended: boolean): string {
  const words = item.runs.flatMap((run) => [
    ...(OUTCOMES[run.outcome] ?? []),
    ...differences(item, run, run.changed),
    ...(run.least_range_percent === null
      ? []
      : [`less range while it played, down to ${Math.round(run.least_range_percent)} %`]),
  ]);
  if (item.done === "none") words.unshift(ended ? "Left out" : "Not yet");
  return words.length > 0 ? words.join(", ") : "–";
}
