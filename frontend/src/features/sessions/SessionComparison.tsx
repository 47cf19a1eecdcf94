import { Card, Group, Select, Stack, Table, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Session } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { ProblemNote } from "../../ui/ProblemNote";
import { compareSessions } from "./compareSessions";
import { BESIDE } from "./sessionMessages";
import { Head, Row } from "./sessionRows";

/** Compares this session with another one of the patient. */
export function SessionComparison({ session }: { session: Session }) {
  const patientId = session.patient.id;
  const [chosen, setChosen] = useState<string | null>(null);
  const sessions = usePagedQuery(["sessions", "of", patientId], (after) =>
    api.patientSessions(patientId, after),
  );
  const other = useQuery({
    queryKey: ["session", chosen],
    queryFn: () => api.session(chosen ?? ""),
    enabled: chosen !== null,
  });
  const others = (sessions.items ?? []).filter((one) => one.id !== session.id);
  if (others.length === 0) return null;
  return (
    <Card withBorder component="section" aria-label={BESIDE.title}>
      <Stack>
        <Title order={2} size="h3">
          {BESIDE.title}
        </Title>
        <Group align="end">
          <Select
            label={BESIDE.which}
            placeholder={BESIDE.none}
            w={320}
            clearable
            data={others.map((one) => ({ value: one.id, label: formatMoment(one.started_at) }))}
            value={chosen}
            onChange={setChosen}
          />
          <LoadMoreButton list={sessions} words={BESIDE.older} />
        </Group>
        <ProblemNote error={sessions.error ?? other.error} />
        {chosen && other.data && <Both other={other.data} here={session} />}
      </Stack>
    </Card>
  );
}

function Both({ other, here }: { other: Session; here: Session }) {
  return (
    <Table.ScrollContainer minWidth={640}>
      <Table withTableBorder verticalSpacing="xs" data-testid="beside">
        <Table.Caption>{BESIDE.caption}</Table.Caption>
        <Head
          first={BESIDE.what}
          others={[formatMoment(other.started_at), BESIDE.here(formatMoment(here.started_at)), BESIDE.change]}
        />
        {compareSessions(other, here).map((part) => (
          <Table.Tbody key={part.key}>
            <Table.Tr>
              <Table.Th colSpan={4} scope="rowgroup">
                {part.title}
              </Table.Th>
            </Table.Tr>
            {part.lines.map((line) => (
              <Row key={line.what} first={line.what} others={[line.other, line.here, line.change]} />
            ))}
          </Table.Tbody>
        ))}
      </Table>
    </Table.ScrollContainer>
  );
}
